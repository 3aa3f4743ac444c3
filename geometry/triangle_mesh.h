// SPDX-License-Identifier: GPL-3.0-or-later
// Triangle meshes as data, and who is whose neighbour in them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace toile {

using Triangle = std::array<int, 3>;  // vertices, counter-clockwise seen from the outside

struct TriangleMesh {
  Eigen::Matrix3Xd vertices;  // unit and axes of whoever made it
  std::vector<Triangle> triangles;
};

// Edges and neighbours of triangles whose three vertices differ. Edges are in the order of their vertices, faces around
// an edge or a vertex in that of the mesh. Throws GeometryError for a vertex out of range or twice in a triangle.
class MeshTopology {
 public:
  MeshTopology(std::span<const Triangle> triangles, int vertex_count);

  int edge_count() const { return static_cast<int>(edges_.size()); }
  // Its two vertices, the lower first.
  const std::array<int, 2>& edge(int e) const { return edges_[e]; }
  std::span<const int> faces_of_edge(int e) const { return slice(edge_faces_, edge_begin_, e); }
  std::span<const int> faces_of_vertex(int v) const { return slice(vertex_faces_, vertex_begin_, v); }
  // Edge k of a face joins its corners k and k + 1.
  const std::array<int, 3>& edges_of_face(int f) const { return face_edges_[f]; }
  // Whether the face runs along the edge from its lower to its higher vertex.
  bool runs_along(int face, int e) const;

 private:
  static std::span<const int> slice(const std::vector<int>& of, const std::vector<int>& begin, int k) {
    return std::span(of).subspan(begin[k], begin[k + 1] - begin[k]);
  }
  std::vector<std::array<int, 2>> edges_;
  std::vector<std::array<int, 3>> face_edges_;
  std::vector<int> edge_begin_, edge_faces_, vertex_begin_, vertex_faces_;
  std::vector<char> along_;  // of face and corner
};

// Of parts that share edges: each face's part, numbered in the order of their first faces.
std::vector<int> connected_parts(const MeshTopology& topology, int face_count, int& part_count);

}  // namespace toile
