// SPDX-License-Identifier: GPL-3.0-or-later
// Strain rows whose vector y is a mean of tangents instead of one at a point.
#pragma once

#include <vector>

#include "analysis/constraint/constraint_rows.h"
#include "analysis/constraint/point_rule.h"

namespace toile {

// PointRule::cell_average: weft and warp of every cell, y = the mean of the tangent over the cell's material (its
//   quadrature) over that mean's length at rest. Not the mean of E, which no row gives: to second order in strain and
//   in the angle by which a cell bends they agree.
// PointRule::springs_quad: between neighbouring knot vertices in the material with cloth beside them, along u and along
//   v, y = (x(b) - x(a)) / L with L = |X(b) - X(a)|, so that C = (l^2 / L^2 - 1) / 2: eq. 35 to first order in strain.
//   They follow the net, not the threads; at trims nothing is held, and a spring may bridge a gap within a cell.
// PointRule::springs_triangle: the same and one diagonal of every cell whose ends are in the material, in turns.
// Other rules have none. Areas: a cell's own; for springs half of the cells beside them, so that those along u add up
// to an untrimmed panel, as do those along v (at trims a spring without both ends takes its cloth with it); diagonals
// their cell. Rows are hard.
//   (1) C = 0 at rest; (2) springs over a seam of a closed surface are taken once.
// Throws GeometryError where two neighbouring vertices are one place.
std::vector<StrainRow> averaged_rows(const Body& body, int panel, const TrimTopology& topology, const Closure& closure,
                                     PointRule rule);

}  // namespace toile
