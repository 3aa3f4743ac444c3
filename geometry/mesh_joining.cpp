// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/mesh_joining.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "geometry/finite.h"

namespace toile {

namespace {

using Eigen::Vector3d;

std::vector<int> border_vertices(const TriangleMesh& mesh) {
  const MeshTopology topology(mesh.triangles, static_cast<int>(mesh.vertices.cols()));
  std::vector<char> on(mesh.vertices.cols(), 0);
  for (int e = 0; e < topology.edge_count(); ++e)
    if (topology.faces_of_edge(e).size() == 1)
      for (const int v : topology.edge(e)) on[v] = 1;
  std::vector<int> out;
  for (int v = 0; v < static_cast<int>(on.size()); ++v)
    if (on[v]) out.push_back(v);
  return out;
}

// Border vertices in the order of one coordinate.
class Sweep {
 public:
  explicit Sweep(const TriangleMesh& mesh) : mesh_(mesh), order_(border_vertices(mesh)) {
    Eigen::AlignedBox3d box;
    for (const int v : order_) box.extend(mesh.vertices.col(v));
    if (!order_.empty()) box.diagonal().maxCoeff(&axis_);
    std::ranges::sort(order_, {}, [&](int v) { return std::pair(mesh.vertices(axis_, v), v); });
  }
  const std::vector<int>& order() const { return order_; }
  // found(v) for all whose coordinate is between those of the two places, or within `gap` of them.
  template <class Found>
  void between(const Vector3d& a, const Vector3d& b, double gap, const Found& found) const {
    const double from = std::min(a[axis_], b[axis_]) - gap, to = std::max(a[axis_], b[axis_]) + gap;
    auto at = std::ranges::lower_bound(order_, from, {}, [&](int v) { return mesh_.vertices(axis_, v); });
    for (; at != order_.end() && mesh_.vertices(axis_, *at) <= to; ++at) found(*at);
  }

 private:
  const TriangleMesh& mesh_;
  std::vector<int> order_;
  Eigen::Index axis_ = 0;
};

// Border vertices nearer than `gap` become the lowest of them.
void merge_border_vertices(TriangleMesh& mesh, double gap) {
  std::vector<int> stands(mesh.vertices.cols());
  for (std::size_t v = 0; v < stands.size(); ++v) stands[v] = static_cast<int>(v);
  {
    const Sweep sweep(mesh);
    std::vector<int> ascending = sweep.order();
    std::ranges::sort(ascending);
    for (const int v : ascending) {
      const Vector3d x = mesh.vertices.col(v);
      sweep.between(x, x, gap, [&](int w) {
        if (w < stands[v] && stands[w] == w && (mesh.vertices.col(w) - x).norm() <= gap) stands[v] = w;
      });
    }
  }
  for (Triangle& t : mesh.triangles)
    for (int& v : t) v = stands[v];
  std::erase_if(mesh.triangles, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
}

// A triangle whose edges hold points, in order, as triangles that have these as corners.
struct Cut {
  Triangle corners;
  std::array<std::vector<int>, 3> points;  // on edge k, from corner k on
};

void cut(const Cut& whole, std::vector<Triangle>& out) {
  std::vector<Cut> open{whole};
  while (!open.empty()) {
    const Cut now = std::move(open.back());
    open.pop_back();
    int k = 0;
    while (k < 3 && now.points[k].empty()) ++k;
    if (k == 3) {
      out.push_back(now.corners);
      continue;
    }
    const int a = now.corners[k], b = now.corners[(k + 1) % 3], c = now.corners[(k + 2) % 3];
    std::vector<int> along{a};
    along.insert(along.end(), now.points[k].begin(), now.points[k].end());
    along.push_back(b);
    for (std::size_t i = 0; i + 1 < along.size(); ++i) {
      Cut piece{{along[i], along[i + 1], c}, {}};
      if (i + 2 == along.size()) piece.points[1] = now.points[(k + 1) % 3];
      if (i == 0) piece.points[2] = now.points[(k + 2) % 3];
      open.push_back(std::move(piece));
    }
  }
}

}  // namespace

TriangleMesh join_borders(TriangleMesh mesh, double gap) {
  require_finite(gap, "the gap between borders");
  for (const Triangle& t : mesh.triangles)
    for (const int v : t)
      require_finite(Vector3d(mesh.vertices.col(v)), ("vertex " + std::to_string(v) + " of the mesh").c_str());
  // Corners that are the same before those that are only near.
  merge_border_vertices(mesh, 1e-3 * gap);
  merge_border_vertices(mesh, 0.25 * gap);
  const MeshTopology topology(mesh.triangles, static_cast<int>(mesh.vertices.cols()));
  const Sweep sweep(mesh);
  std::vector<Triangle> out;
  for (int f = 0; f < static_cast<int>(mesh.triangles.size()); ++f) {
    const Triangle& t = mesh.triangles[f];
    Cut whole{t, {}};
    for (int k = 0; k < 3; ++k) {
      if (topology.faces_of_edge(topology.edges_of_face(f)[k]).size() != 1) continue;
      const Vector3d a = mesh.vertices.col(t[k]), b = mesh.vertices.col(t[(k + 1) % 3]), along = b - a;
      std::vector<std::pair<double, int>> on;
      sweep.between(a, b, gap, [&](int v) {
        if (std::ranges::find(t, v) != t.end()) return;
        const Vector3d x = mesh.vertices.col(v);
        const double s = along.dot(x - a) / along.squaredNorm();
        if (s > 0 && s < 1 && (a + s * along - x).norm() <= gap) on.emplace_back(s, v);
      });
      std::ranges::sort(on);
      for (const auto& [s, v] : on) whole.points[k].push_back(v);
    }
    cut(whole, out);
  }
  mesh.triangles = std::move(out);
  return mesh;
}

}  // namespace toile
