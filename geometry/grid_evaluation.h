// SPDX-License-Identifier: GPL-3.0-or-later
// Many surface points at once. Points that share a span share its control points; points on a grid share their basis
// values and, by sum factorisation, most of the sum too.
#pragma once

#include <span>
#include <vector>

#include "geometry/basis.h"
#include "geometry/nurbs_surface.h"

namespace toile {

// Basis values with first and second derivatives at the given parameters, in their order. Consecutive parameters of one
// span are evaluated together, so ascending parameters are fastest.
std::vector<BasisValues> tabulate_basis(const KnotVector& knots, std::span<const double> parameters);

// jets[i + u.size() * j] = evaluate(surface, u_i, v_j), equal to rounding, for tables of the surface's own knots.
// jets.size() must be u.size() * v.size(). Allocates nothing.
void evaluate_grid(const NurbsSurface& surface, std::span<const BasisValues> u, std::span<const BasisValues> v,
                   std::span<SurfaceJet> jets);

// jets[k] = the jet at (u, v) = parameters[k] of the polynomial (or rational) piece on the named spans (knot indices),
// equal to rounding. The sizes must match. Allocates nothing.
void evaluate_on_span(const NurbsSurface& surface, int span_u, int span_v, std::span<const Eigen::Vector2d> parameters,
                      std::span<SurfaceJet> jets);

}  // namespace toile
