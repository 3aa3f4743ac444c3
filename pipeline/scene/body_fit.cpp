// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/scene/body_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

namespace toile {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Where a plane cuts the edges of a mesh, joined to lines.
class Section {
 public:
  Section(const TriangleMesh& mesh, double height) : mesh_(mesh), height_(height) {
    for (const std::array<int, 3>& t : mesh.triangles) {
      std::vector<int> ends;
      for (int k = 0; k < 3; ++k) {
        const int a = t[static_cast<std::size_t>(k)], b = t[static_cast<std::size_t>((k + 1) % 3)];
        if ((mesh.vertices(1, a) < height) != (mesh.vertices(1, b) < height)) ends.push_back(cut(a, b));
      }
      if (ends.size() == 2) join(ends[0], ends[1]);
    }
  }
  TrunkSection longest() {
    TrunkSection out;
    if (length_.empty()) return out;
    int best = 0;
    for (int k = 0; k < static_cast<int>(length_.size()); ++k)
      if (root(k) == k && length_[at(k)] > length_[at(root(best))]) best = k;
    best = root(best);
    out.girth = length_[at(best)];
    int count = 0;
    for (int k = 0; k < static_cast<int>(points_.size()); ++k) {
      if (root(k) != best) continue;
      out.centre += Vector2d(points_[at(k)].x(), points_[at(k)].z());
      ++count;
    }
    out.centre /= count;
    return out;
  }

 private:
  static std::size_t at(int k) { return static_cast<std::size_t>(k); }
  int root(int k) {
    while (parent_[at(k)] != k) k = parent_[at(k)] = parent_[at(parent_[at(k)])];
    return k;
  }
  int cut(int a, int b) {
    if (a > b) std::swap(a, b);
    const auto [found, fresh] = ids_.try_emplace({a, b}, static_cast<int>(points_.size()));
    if (fresh) {
      const Vector3d p = mesh_.vertices.col(a), q = mesh_.vertices.col(b);
      points_.push_back(p + (height_ - p.y()) / (q.y() - p.y()) * (q - p));
      parent_.push_back(found->second);
      length_.push_back(0);
    }
    return found->second;
  }
  void join(int a, int b) {
    const double piece = (points_[at(a)] - points_[at(b)]).norm();
    const int ra = root(a), rb = root(b);
    length_[at(ra)] += piece + (ra == rb ? 0 : length_[at(rb)]);
    parent_[at(rb)] = ra;
  }

  const TriangleMesh& mesh_;
  double height_;
  std::map<std::pair<int, int>, int> ids_;
  std::vector<int> parent_;
  std::vector<double> length_;
  std::vector<Vector3d> points_;
};

}  // namespace

TrunkSection trunk_section(const TriangleMesh& mesh, double height) {
  return Section(mesh, height).longest();
}

Vector3d centre_of_mass(const TriangleMesh& mesh) {
  double volume = 0;
  Vector3d sum(0, 0, 0);
  for (const std::array<int, 3>& t : mesh.triangles) {
    const Vector3d a = mesh.vertices.col(t[0]), b = mesh.vertices.col(t[1]), c = mesh.vertices.col(t[2]);
    const double v = a.dot(b.cross(c)) / 6;
    volume += v;
    sum += v * (a + b + c) / 4;
  }
  const Vector3d middle = (mesh.vertices.rowwise().minCoeff() + mesh.vertices.rowwise().maxCoeff()) / 2;
  return volume > 0 ? Vector3d(sum / volume) : middle;
}

int count_inside(const TriangleMesh& mesh, const std::vector<Vector3d>& points) {
  if (mesh.triangles.empty()) return 0;
  constexpr int bins = 64;
  const Vector3d low = mesh.vertices.rowwise().minCoeff(), high = mesh.vertices.rowwise().maxCoeff();
  const Vector2d size = (high - low).head<2>().cwiseMax(1e-300);
  const auto bin = [&](double x, int axis) {
    return std::clamp(static_cast<int>(bins * (x - low[axis]) / size[axis]), 0, bins - 1);
  };
  std::vector<std::vector<int>> held(bins * bins);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& v = mesh.triangles[t];
    const Vector3d a = mesh.vertices.col(v[0]), b = mesh.vertices.col(v[1]), c = mesh.vertices.col(v[2]);
    const Vector3d least = a.cwiseMin(b).cwiseMin(c), most = a.cwiseMax(b).cwiseMax(c);
    for (int j = bin(least.y(), 1); j <= bin(most.y(), 1); ++j)
      for (int i = bin(least.x(), 0); i <= bin(most.x(), 0); ++i)
        held[static_cast<std::size_t>(i + bins * j)].push_back(static_cast<int>(t));
  }
  int inside = 0;
  for (const Vector3d& p : points) {
    if ((p - low).minCoeff() < 0 || (high - p).minCoeff() < 0) continue;
    int crossed = 0;
    for (const int t : held[static_cast<std::size_t>(bin(p.x(), 0) + bins * bin(p.y(), 1))]) {
      const auto& v = mesh.triangles[static_cast<std::size_t>(t)];
      // The signs of the areas that the point makes with the edges; an edge on the line belongs to one of its sides.
      bool positive = true, negative = true;
      std::array<double, 3> w{};
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector3d a = mesh.vertices.col(v[(k + 1) % 3]), b = mesh.vertices.col(v[(k + 2) % 3]);
        w[k] = (a.x() - p.x()) * (b.y() - p.y()) - (a.y() - p.y()) * (b.x() - p.x());
        const bool left = w[k] > 0 || (w[k] == 0 && (b.y() > a.y() || (b.y() == a.y() && b.x() < a.x())));
        positive = positive && left;
        negative = negative && !left;
      }
      const double sum = w[0] + w[1] + w[2];
      if ((!positive && !negative) || sum == 0) continue;
      double z = 0;
      for (std::size_t k = 0; k < 3; ++k) z += w[k] / sum * mesh.vertices(2, v[k]);
      if (z > p.z()) ++crossed;
    }
    inside += crossed % 2;
  }
  return inside;
}

double turns_around(const std::vector<Vector2d>& polygon, const Vector2d& centre) {
  double sum = 0;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vector2d a = polygon[k] - centre, b = polygon[(k + 1) % polygon.size()] - centre;
    sum += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
  }
  return sum / (2 * std::numbers::pi);
}

}  // namespace toile
