// SPDX-License-Identifier: GPL-3.0-or-later
// Loop validation: what must hold before anything is decided about a trimmed surface, and the repairs that make it so.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "geometry/trimmed_surface.h"

namespace toile {

// One change that validation made, or found tolerable: reported, never silent.
struct LoopRepair {
  int loop = 0;      // file's number
  std::string what;  // "reversed", "closed a gap of 3e-9", "moved into the domain", "snapped to u = 0.5", ...
  double move = 0;   // largest move in the parameter plane
  Eigen::Vector2d place{0, 0};  // where
  bool note = false;            // says nothing against the file: a direction, or a move of the size of rounding
};

struct LoopOptions {
  // Gaps and excursions out of the domain up to this fraction of the domain's size are closed and reported; larger ones
  // are errors.
  double repair_tolerance = 1e-3;
  // Control points and segment ends nearer than this to a knot line move onto it [length, unit of the net; divided by
  // |S_u|, |S_v|]. Unset: the surface's resolution.
  std::optional<double> snap;
};

// Makes every loop closed (end points of neighbours bitwise equal), simple, oriented (outer counter-clockwise, holes
// clockwise by signed area) and nested (holes inside the outer loop, disjoint), moving points only within the
// tolerances; `knots_u/v` are the knot lines that ends snap to. Throws GeometryError naming panel, loop, curve and
// place where a loop can't be made valid. Decisions are exact; the curves keep index and direction of the file.
std::vector<LoopRepair> validate_loops(TrimmedSurface& surface, const LoopOptions& options = {});

}  // namespace toile
