// SPDX-License-Identifier: GPL-3.0-or-later
// Where a mesh passes through itself.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace toile {

struct SelfCrossing {
  int a = 0, b = 0;  // triangles, a < b
  Eigen::Vector3d place{0, 0, 0};
};

// Pairs of triangles of which an edge of one passes through the inside of the other, beyond what rounding could feign;
// ascending. What merely touches is none, nor what neighbours do along their common edge.
std::vector<SelfCrossing> self_crossings(const TriangleMesh& mesh);

}  // namespace toile
