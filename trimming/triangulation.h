// Triangles over the material of a trimmed surface, for looking at it: cells split along knot lines and trims.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "trimming/topology.h"

namespace toile {

//   (1) the triangles cover the material, orient counter-clockwise in the parameter plane and don't cross knot lines;
//   (2) trims are followed within `chord` of the cell size;
//   (3) vertices on a knot line or trim are shared: the mesh is conforming.
struct TrimmedTriangles {
  std::vector<Eigen::Vector2d> uv;
  std::vector<std::array<int, 3>> triangles;
};
struct TriangulationOptions {
  int per_cell = 4;       // uncut cells become per_cell x per_cell quads, two triangles each
  double chord = 0.005;   // largest sagitta of a trim segment, as a fraction of the cell's size
};
TrimmedTriangles triangulate(const TrimmedSurface& surface, const TrimTopology& topology,
                             const TriangulationOptions& options = {});

}  // namespace toile
