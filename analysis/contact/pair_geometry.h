// SPDX-License-Identifier: GPL-3.0-or-later
// Where triangles and lines are nearest, as contact asks for it.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>

namespace toile {

// Weights of the corners of a triangle at the place that p is over or beside; unset for a triangle without area.
inline std::optional<Eigen::Vector3d> weights_below(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                                    const Eigen::Vector3d& c, const Eigen::Vector3d& p) {
  const Eigen::Vector3d ab = b - a, ac = c - a, normal = ab.cross(ac);
  const double area = normal.squaredNorm();
  if (!(area > 0)) return std::nullopt;
  const double v = normal.dot((p - a).cross(ac)) / area, w = normal.dot(ab.cross(p - a)) / area;
  return Eigen::Vector3d(1 - v - w, v, w);
}

// Shares of two lines, from a along `along` and from b along `other`, at which they are nearest; unset where the sine
// of the angle between them is below 0.05: such lines meet nowhere in particular.
inline std::optional<std::array<double, 2>> nearest_on_lines(const Eigen::Vector3d& a, const Eigen::Vector3d& along,
                                                             const Eigen::Vector3d& b, const Eigen::Vector3d& other) {
  constexpr double parallel = 0.05;
  const double aa = along.squaredNorm(), bb = other.squaredNorm(), ab = along.dot(other), det = aa * bb - ab * ab;
  if (!(det > parallel * parallel * aa * bb)) return std::nullopt;
  const Eigen::Vector3d between = a - b;
  return std::array{(ab * other.dot(between) - bb * along.dot(between)) / det,
                    (aa * other.dot(between) - ab * along.dot(between)) / det};
}

}  // namespace toile
