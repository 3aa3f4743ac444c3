// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/triangle_mesh.h"

#include <algorithm>
#include <string>
#include <tuple>

#include "geometry/error.h"

namespace toile {

MeshTopology::MeshTopology(std::span<const Triangle> triangles, int vertex_count) {
  struct Side {
    int low, high, face, corner;
  };
  const int face_count = static_cast<int>(triangles.size());
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  along_.resize(3 * triangles.size());
  face_edges_.resize(triangles.size());
  vertex_begin_.assign(vertex_count + 1, 0);
  for (int f = 0; f < face_count; ++f) {
    const Triangle& t = triangles[f];
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      if (a < 0 || a >= vertex_count || a == b)
        throw GeometryError("triangle " + std::to_string(f) + " has the vertices " + std::to_string(t[0]) + ", " +
                            std::to_string(t[1]) + ", " + std::to_string(t[2]) + " of " + std::to_string(vertex_count));
      sides.push_back({std::min(a, b), std::max(a, b), f, k});
      along_[3 * f + k] = a < b;
      ++vertex_begin_[a + 1];
    }
  }
  for (int v = 0; v < vertex_count; ++v) vertex_begin_[v + 1] += vertex_begin_[v];
  vertex_faces_.resize(sides.size());
  std::vector<int> next(vertex_begin_.begin(), vertex_begin_.end() - 1);
  for (int f = 0; f < face_count; ++f)
    for (const int v : triangles[f]) vertex_faces_[next[v]++] = f;

  std::ranges::sort(sides, {}, [](const Side& s) { return std::tuple(s.low, s.high, s.face); });
  for (const Side& side : sides) {
    const std::array<int, 2> edge{side.low, side.high};
    if (edges_.empty() || edges_.back() != edge) {
      edges_.push_back(edge);
      edge_begin_.push_back(static_cast<int>(edge_faces_.size()));
    }
    face_edges_[side.face][side.corner] = static_cast<int>(edges_.size()) - 1;
    edge_faces_.push_back(side.face);
  }
  edge_begin_.push_back(static_cast<int>(edge_faces_.size()));
}

bool MeshTopology::runs_along(int face, int e) const {
  for (int k = 0; k < 3; ++k)
    if (face_edges_[face][k] == e) return along_[3 * face + k];
  throw GeometryError("face " + std::to_string(face) + " has no edge " + std::to_string(e));
}

std::vector<int> connected_parts(const MeshTopology& topology, int face_count, int& part_count) {
  std::vector<int> part(face_count, -1), open;
  part_count = 0;
  for (int first = 0; first < face_count; ++first) {
    if (part[first] >= 0) continue;
    part[first] = part_count;
    open.push_back(first);
    while (!open.empty()) {
      const int f = open.back();
      open.pop_back();
      for (const int e : topology.edges_of_face(f))
        for (const int g : topology.faces_of_edge(e))
          if (part[g] < 0) {
            part[g] = part_count;
            open.push_back(g);
          }
    }
    ++part_count;
  }
  return part;
}

}  // namespace toile
