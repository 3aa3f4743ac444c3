// SPDX-License-Identifier: GPL-3.0-or-later
// C0 knot lines: the cloth goes on across them, so a bend there costs what bending a narrow strip of the same cloth
// costs. [after the bending strips of Kiendl et al. 2010, with the angle itself in place of their fictitious surface]
//
// Per length of line: width * psi((theta - theta0) / width), theta the angle by which the tangent plane turns across
// the line, theta0 at rest (0 where the fabric's rest curvature is), psi the fabric's bending energy for a curvature
// across the line, width a tenth of the narrower neighbouring cell. No membrane, no mass.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/map/smooth_seam.h"
#include "geometry/closure.h"
#include "trimming/topology.h"

namespace toile {

// A quadrature point on a kink: the line `direction` = `at` (direction u: u = at), at the other parameter `along`;
// `weight` is a length of that parameter. At the start of the domain the line is the seam of a closed surface, and the
// side before it lies at the domain's end.
struct KinkPoint {
  Direction direction = Direction::u;
  double at = 0, along = 0, weight = 0;
};

// Gauss points on the interior knot lines of multiplicity >= degree and on the seams of a closed surface, as far as the
// cloth lies on both sides.
std::vector<KinkPoint> kink_points(const TrimmedSurface& surface, const TrimTopology& topology,
                                   const Closure& closure = {});

// Leaves out the strips that smooth seams don't need.
void drop_strips(const NurbsSurface& surface, const SmoothSeams& seams, std::vector<KinkPoint>& kinks);

// Width of the strip as part of the narrower neighbouring cell: a line makes the cloth softer by this part of a cell,
// and where bending bounds the step, the bound falls to about a third. (analysis/README.md)
constexpr double strip_width = 0.1;

}  // namespace toile
