// SPDX-License-Identifier: GPL-3.0-or-later
// The material of a trimmed panel as triangles of which none crosses a knot line: what contact sees of it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "trimming/topology.h"

namespace toile {

//   (1) triangles turn left in the parameter plane, each lies in one knot cell;
//   (2) together they cover the material of every cell but for what chords of its trims cut off or add;
//   (3) a place is one vertex, so that neighbouring cells share their border's vertices and edges.
struct CellTriangles {
  std::vector<Eigen::Vector2d> uv;
  std::vector<std::array<int, 3>> triangles;
  std::vector<int> cell;  // KnotMesh::cell of each triangle
};

// A lattice of `divisions` (in u, in v) in each cell; trims are divided into pieces no longer than its spacing. Throws
// GeometryError where a division isn't positive or more than four million triangles would result.
CellTriangles triangulate_cells(const TrimmedSurface& surface, const TrimTopology& topology,
                                std::pair<int, int> divisions);

}  // namespace toile
