// SPDX-License-Identifier: GPL-3.0-or-later
// Seams of closed surfaces that are smooth at rest stay smooth: the seam's control points follow those beside it.
//
// Across a seam of a clamped net the tangents are p/h (w1/w0) (P1 - P0) on one side and p/h' (w'/w0) (P0 - P') on the
// other, line by line along the seam. Where P0 - P' = c (P1 - P0) on every line, and the weights keep their ratio along
// the seam, both sides have one tangent plane in every state with P0 = (c P1 + P') / (1 + c): at p = 2 the space of the
// periodic spline. No strip is needed there, nor does one bound the step.
#pragma once

#include <vector>

#include "analysis/map/affine_map.h"
#include "geometry/closure.h"

namespace toile {

// Lines of control points that cross the seams: of the seam in u the rows j, of the seam in v the columns i; true where
// the control point on the seam follows its neighbours. Empty where nothing is closed.
struct SmoothSeams {
  std::vector<bool> u, v;
  bool any() const;
  bool follows(const NurbsSurface& surface, int control_point) const;
  // Is the seam across `d` smooth at `at` along it?
  bool at(const NurbsSurface& surface, Direction d, double at) const;
};

// Ties smooth seams in `dependence` (of one panel, whose seam followers have their leaders' rows). A line on which one
// of the three control points already follows others stays as it is. `tolerance`: how far a seam's control point may
// move.
SmoothSeams tie_smooth_seams(const NurbsSurface& rest, const Closure& closure, double tolerance,
                             AffineMap::Matrix& dependence);

}  // namespace toile
