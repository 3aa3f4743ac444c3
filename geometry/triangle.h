// SPDX-License-Identifier: GPL-3.0-or-later
// The point of a triangle nearest to a place.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace toile {

struct TrianglePoint {
  Eigen::Vector3d point;
  // Where it lies: 0 inside, 1 to 3 on the edge from corner 0, 1, 2 to the next, 4 to 6 at a corner.
  int part = 0;
};

// By the regions of Ericson, Real-Time Collision Detection (2005), 5.1.5. A triangle without area is its edges.
inline TrianglePoint closest_on_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                                         const Eigen::Vector3d& p) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return {a, 4};
  if (d3 >= 0 && d4 <= d3) return {b, 5};
  if (d6 >= 0 && d5 <= d6) return {c, 6};
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return {a + d1 / (d1 - d3) * ab, 1};
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {a + d2 / (d2 - d6) * ac, 3};
  if (va <= 0 && d4 >= d3 && d5 >= d6) return {b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b), 2};
  const double sum = va + vb + vc;
  constexpr double rounding = 64 * std::numeric_limits<double>::epsilon();
  const double terms = std::abs(d1 * d4) + std::abs(d3 * d2) + std::abs(d5 * d2) + std::abs(d1 * d6) +
                       std::abs(d3 * d6) + std::abs(d5 * d4);
  if (sum > rounding * terms) return {a + vb / sum * ab + vc / sum * ac, 0};
  // The corners are on one line, as far as can be told from p.
  TrianglePoint best;
  double least = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d corners[] = {a, b, c, a};
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d along = corners[k + 1] - corners[k];
    const double s = std::clamp(along.dot(p - corners[k]) / std::max(along.squaredNorm(), 1e-300), 0.0, 1.0);
    const Eigen::Vector3d q = corners[k] + s * along;
    if (const double d = (q - p).squaredNorm(); d < least) {
      least = d;
      best = {q, s == 0 ? 4 + k : s == 1 ? 4 + (k + 1) % 3 : 1 + k};
    }
  }
  return best;
}

}  // namespace toile
