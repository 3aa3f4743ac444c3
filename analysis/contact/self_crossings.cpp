// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/self_crossings.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "analysis/contact/bounds_tree.h"

namespace toile {

namespace {

using Eigen::Vector3d;

// The sign of det(a - d, b - d, c - d); 0 where rounding could have made it (Shewchuk 1997, the filter of orient3d).
int side(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const Vector3d u = a - d, v = b - d, w = c - d;
  const double det = u.dot(v.cross(w));
  const Vector3d sums(std::abs(v.y() * w.z()) + std::abs(v.z() * w.y()),
                      std::abs(v.z() * w.x()) + std::abs(v.x() * w.z()),
                      std::abs(v.x() * w.y()) + std::abs(v.y() * w.x()));
  constexpr double share = 8 * std::numeric_limits<double>::epsilon();
  if (std::abs(det) <= share * u.cwiseAbs().dot(sums)) return 0;
  return det > 0 ? 1 : -1;
}

// Where the segment pq passes through the inside of the triangle.
std::optional<Vector3d> passes(const Vector3d& p, const Vector3d& q, const Vector3d& a, const Vector3d& b,
                               const Vector3d& c) {
  if (side(a, b, c, p) * side(a, b, c, q) >= 0) return std::nullopt;
  const int s = side(p, q, a, b);
  if (s == 0 || side(p, q, b, c) != s || side(p, q, c, a) != s) return std::nullopt;
  const Vector3d n = (b - a).cross(c - a);
  const double from = n.dot(p - a), to = n.dot(q - a);
  return p + from / (from - to) * (q - p);
}

}  // namespace

std::vector<SelfCrossing> self_crossings(const TriangleMesh& mesh) {
  std::vector<Box> boxes;
  for (const Triangle& t : mesh.triangles) {
    Box box;
    for (const int v : t) box.extend(mesh.vertices.col(v));
    boxes.push_back(box);
  }
  const auto at = [&](int v) -> Vector3d { return mesh.vertices.col(v); };
  // An edge of `from` that has no corner in common with `through`.
  const auto crosses = [&](const Triangle& from, const Triangle& through) -> std::optional<Vector3d> {
    const auto shared = [&](int v) { return std::ranges::find(through, v) != through.end(); };
    for (int k = 0; k < 3; ++k) {
      const int p = from[k], q = from[(k + 1) % 3];
      if (shared(p) || shared(q)) continue;
      if (const auto place = passes(at(p), at(q), at(through[0]), at(through[1]), at(through[2]))) return place;
    }
    return std::nullopt;
  };
  std::vector<SelfCrossing> out;
  BoundsTree(boxes).own_pairs(0, [&](int a, int b) {
    const Triangle &s = mesh.triangles[a], &t = mesh.triangles[b];
    auto place = crosses(s, t);
    if (!place) place = crosses(t, s);
    if (place) out.push_back({a, b, *place});
  });
  std::ranges::sort(out, {}, [](const SelfCrossing& x) { return std::pair(x.a, x.b); });
  return out;
}

}  // namespace toile
