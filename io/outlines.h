// SPDX-License-Identifier: GPL-3.0-or-later
// From the loose curves of a pattern drawing to panels: what an outline-only IGES or a DXF file holds.
#pragma once

#include <string>
#include <vector>

#include "geometry/trimmed_surface.h"

namespace toile {

// One entity of the drawing: its curves in the file's order, closed among themselves or not.
struct LooseCurve {
  int id = 0;  // the caller's number, for messages and for order
  std::string name;
  std::vector<Curve3> pieces;
};
struct LoosePoint {
  int id = 0;
  std::string name;
  Eigen::Vector3d at{0, 0, 0};
  std::string text;  // empty: a point
};

struct OutlineNote {
  int id = 0;  // of the entity
  std::string what;
  bool refused = false;  // a panel was meant, and is left out
};
struct Outlines {
  std::vector<TrimmedSurface> panels;  // unit of the curves; `name` of the first named curve of the outline, or empty
  std::vector<int> ids;                // of each panel's first outline curve
  std::vector<OutlineNote> notes;
};

// Closed chains become outlines: those inside an even number of others are panels, the others their holes.
//   (1) curves whose ends are nearer than the joining tolerance, max(resolution, 1e-5 of the drawing's size), are
//       joined; a curve that stays open, and a closed one that crosses an outline, is a mark; an outline drawn again is
//       left out with a note; two curves that run along each other between the same ends are one drawn twice, or a slit
//       where the outline goes on without them;
//   (2) an outline in a coordinate plane keeps its coordinates bitwise as parameters, in any other plane they are
//       Cartesian in that plane: parameter curves are the curves' own images, degree, knots and weights kept;
//   (3) loop 0 is the outline, holes follow by id; curve K is the K-th along it from the first curve of the smallest id
//       on, in that curve's direction; curves that were drawn the other way are turned;
//   (4) marks and texts go to the innermost panel that holds them. A mark called "grain" is the grain line, else the
//       only straight line that lies inside without touching the outline; short ones that touch it are notches.
//   (5) what is drawn out and back, and loops of a crossing below ten steps of the coordinates (io/outline_repair.h),
//       goes from an outline with a note; slits become marks. An outline that crosses itself otherwise makes no panel.
// Who is inside whom is decided exactly. Curves that make no panel are left out with a note; where there is no panel at
// all, one says where the first outline is open and by how much.
Outlines find_outlines(std::vector<LooseCurve> curves, const std::vector<LoosePoint>& points, double resolution);

}  // namespace toile
