// SPDX-License-Identifier: GPL-3.0-or-later
// C0 knot lines of a panel: places where the cloth goes on, with a kink.
#pragma once

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

// Leaves out the points on smooth seams, which need no strip.
void drop_strips(const NurbsSurface& surface, const SmoothSeams& seams, std::vector<KinkPoint>& kinks);

}  // namespace toile
