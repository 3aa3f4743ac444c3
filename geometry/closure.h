// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces that close on themselves: a tube's first and last line of control points are one line of material.
#pragma once

#include <vector>

#include "geometry/nurbs_surface.h"

namespace toile {

// Closed in u: the lines u = min and u = max of the domain are the same curve in space, the seam.
struct Closure {
  bool u = false, v = false;
  bool any() const { return u || v; }
  bool in(Direction d) const { return d == Direction::u ? u : v; }
};

// Do the first and the last line of control points across `d` coincide within `tolerance` (a length, unit of the net)?
bool ends_meet(const NurbsSurface& surface, Direction d, double tolerance);

// Where ends meet and their weights are in one ratio (within 1e-10): in other ratios the edges are two different curves
// on the same control points. The knots must be clamped.
Closure find_closure(const NurbsSurface& surface, double tolerance);

// The surface with the control points of its last lines made those of the first, bitwise.
NurbsSurface close_exactly(const NurbsSurface& surface, const Closure& closure);

// For each control point the lowest one that is the same point of a closed surface; itself where there is none.
//   (1) leader[leader[k]] = leader[k] <= k; (2) corners of a surface closed both ways have one leader.
std::vector<int> seam_leaders(const NurbsSurface& surface, const Closure& closure);

// Does the edge of the domain at the start (end 0) or the end (end 1) of `d` collapse to one point (a pole)?
bool collapsed(const NurbsSurface& surface, Direction d, int end, double tolerance);

}  // namespace toile
