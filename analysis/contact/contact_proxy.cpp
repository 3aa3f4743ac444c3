// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/contact_proxy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "analysis/parallel/workers.h"
#include "geometry/error.h"

namespace toile {

using Eigen::Vector3d;

ContactProxy::ContactProxy(const Body& body, const AffineMap& map, const Eigen::VectorXd& node_mass,
                           const std::vector<ProxyPanel>& panels)
    : inverse_mass_(node_mass.cwiseInverse()) {
  if (panels.size() != body.panels().size()) throw SolverError("contact: one proxy per panel expected");
  ConstraintRows places;
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const int first = vertices();
    half_thickness_.push_back(panels[p].half_thickness);
    friction_.push_back(panels[p].friction);
    for (const Eigen::Vector2d& uv : panels[p].mesh.uv) {
      panel_.push_back(static_cast<int>(p));
      uv_.push_back(uv);
      points_.push_back(body.place(static_cast<int>(p), uv.x(), uv.y()));
      places.place.push_back({points_.back(), 0, {}});
    }
    cells_.insert(cells_.end(), panels[p].mesh.cell.begin(), panels[p].mesh.cell.end());
    for (const auto& t : panels[p].mesh.triangles) triangles_.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  rows_ = compose(map, places);

  std::map<std::array<int, 2>, std::array<int, 2>> across;
  for (const auto& t : triangles_)
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
      std::array<int, 2>& sides =
          across.try_emplace({std::min(a, b), std::max(a, b)}, std::array{-1, -1}).first->second;
      (sides[0] < 0 ? sides[0] : sides[1]) = c;
    }
  edges_start_.assign(static_cast<std::size_t>(vertices()) + 1, 0);
  for (const auto& [edge, sides] : across) {
    edges_.push_back(edge);
    opposite_.push_back(sides);
    for (const int v : edge) ++edges_start_[static_cast<std::size_t>(v) + 1];
  }
  std::partial_sum(edges_start_.begin(), edges_start_.end(), edges_start_.begin());
  edges_at_.resize(2 * edges_.size());
  neighbours_.resize(edges_at_.size());
  std::vector<int> next(edges_start_.begin(), edges_start_.end() - 1);
  for (std::size_t e = 0; e < edges_.size(); ++e)
    for (const int v : edges_[e]) {
      const auto at = static_cast<std::size_t>(next[static_cast<std::size_t>(v)]++);
      edges_at_[at] = static_cast<int>(e);
      neighbours_[at] = edges_[e][0] + edges_[e][1] - v;
    }
}

void ContactProxy::positions(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Matrix3Xd& fixed_places,
                             Eigen::Matrix3Xd& out, Workers* workers) const {
  out.resize(3, vertices());
  share_out(workers, vertices(), [&](int begin, int end) { evaluate(rows_, x, fixed_places, begin, end, out); });
}

std::span<const int> ContactProxy::neighbours(int vertex) const {
  const auto first = static_cast<std::size_t>(edges_start_[static_cast<std::size_t>(vertex)]),
             end = static_cast<std::size_t>(edges_start_[static_cast<std::size_t>(vertex) + 1]);
  return std::span(neighbours_).subspan(first, end - first);
}

double ContactProxy::chord_error(int vertex, const Eigen::Matrix3Xd& positions, const Vector3d& normal) const {
  double error = 0;
  for (int k = edges_start_[static_cast<std::size_t>(vertex)]; k < edges_start_[static_cast<std::size_t>(vertex) + 1];
       ++k) {
    const auto e = static_cast<std::size_t>(edges_at_[static_cast<std::size_t>(k)]);
    if (opposite_[e][1] < 0) continue;
    const Vector3d a = positions.col(edges_[e][0]), along = positions.col(edges_[e][1]) - a;
    const Vector3d c = positions.col(opposite_[e][0]) - a, d = positions.col(opposite_[e][1]) - a;
    if (normal.dot(c + d - along) < 0) continue;  // bulges the other way
    const Vector3d left = along.cross(c), right = d.cross(along);
    const double length = along.norm(), two_areas = left.norm() + right.norm();
    const double angle = std::atan2(left.cross(right).norm(), left.dot(right));
    if (length > 0) error = std::max(error, two_areas / (2 * length) * angle / 8);
  }
  return error;
}

}  // namespace toile
