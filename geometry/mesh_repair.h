// SPDX-License-Identifier: GPL-3.0-or-later
// A triangle mesh made fit to be the surface of a body.
#pragma once

#include <string>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace toile {

struct RepairedMesh {
  TriangleMesh mesh;
  std::vector<int> vertex_of;  // for each vertex, the one of the given mesh that lies there
  bool closed = true;
  std::vector<std::string> repairs;   // what was changed, with count and place
  std::vector<std::string> warnings;  // what it lacks
};

// Numbers and places are those of the mesh as given. The result satisfies:
//   (1) every vertex is used, no two of a part are within a millionth of the size, no triangle is without area;
//   (2) an edge has two faces at most, which run along it in opposite ways; the faces around a vertex are one fan: what
//       merely touches is taken apart, and so are, with a warning, faces of which no two go on in each other (three
//       that meet in an edge, a band with a half twist);
//   (3) a closed part faces outwards, unless it lies in another one and the file says otherwise.
// Triangles without area are taken out or flipped, twins are taken out, minorities turned. Throws GeometryError where
// no triangle is left and, with the place, for a number that isn't finite.
RepairedMesh repair_mesh(const TriangleMesh& mesh);

// How often the triangles wind around p: of a closed mesh that faces outwards 1 inside and 0 outside.
double winding_number(const Eigen::Matrix3Xd& vertices, std::span<const Triangle> triangles, const Eigen::Vector3d& p);

}  // namespace toile
