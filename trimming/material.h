// SPDX-License-Identifier: GPL-3.0-or-later
// The region that the loops of a face bound: loops that cross, or share pieces, become loops that do neither.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "geometry/trimmed_surface.h"
#include "trimming/loops.h"

namespace toile {

struct MaterialOptions {
  // Loop 0 is the outer one and the others are holes, taken away from it wherever they lie. A loop beside it takes
  // nothing away and is left out, but where others lie within it: that one is a second outer loop. Else loops within
  // loops are holes and islands in turn, and loops that cross each other are refused.
  bool outer_known = true;
  Eigen::Vector2d tolerance{1e-10, 1e-10};  // places nearer than this count as one (arrangement.h)
};

//   (1) The panels' loops are simple; of one panel, the first holds the others, and those lie apart but for touches.
//   (2) A piece that one loop runs along in both directions bounds nothing: it is a mark, of kind `slit`, of the panel
//       that it lies in; "bridge" by its text where it joins the outer loop with a hole.
//   (3) Curves are pieces of the given ones over the same parameters, with their numbers; where a loop is made of
//       several, the numbers of the later ones follow on those of the first.
//   (4) Loops that need no cut come out as they came in; `source` is their position, -1 for loops that were made.
struct Material {
  struct Panel {
    std::vector<TrimLoop> loops;
    std::vector<int> source;
    std::vector<PanelMark> marks;
  };
  std::vector<Panel> panels;
  std::vector<int> idle;  // positions of loops that lie beside the outer one
  std::vector<LoopRepair> changes;
};

// What counts as one place where the loops of a surface meet: the file's resolution, within 1e-10 to 1e-6 of the panel.
Eigen::Vector2d meeting_tolerance(const TrimmedSurface& surface);

// Loops whose joints are bitwise equal. Throws GeometryError, with the place, where a loop crosses itself, where loops
// overlap of which none is known to be a hole, where nothing is left, and where the loops come too near to each other
// to decide.
Material material_of(const std::vector<TrimLoop>& loops, const MaterialOptions& options = {});

}  // namespace toile
