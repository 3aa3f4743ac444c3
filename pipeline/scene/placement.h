// SPDX-License-Identifier: GPL-3.0-or-later
// Where things of a scene are put, and how they move.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

namespace toile {

// x -> translate + R x; R turns about the x, then the y, then the z axis of the scene.
struct Placement {
  Eigen::Vector3d translate{0, 0, 0};  // m
  Eigen::Vector3d rotate{0, 0, 0};     // rad
  Eigen::Matrix3d rotation() const;
};

// Smooth motion of what a pin holds, or of an obstacle: the rigid motion (turn about centre, then translate) is scaled
// by a quintic that rises from 0 to 1 between start and end with velocity and acceleration 0 at both.
struct PinMotion {
  Eigen::Vector3d translate{0, 0, 0};     // m
  Eigen::Vector3d rotate{0, 0, 0};        // rad, about x, then y, then z
  std::optional<Eigen::Vector3d> centre;  // m; unset: mean of the held points, middle of the obstacle's box
  double start = 0, end = 1;              // s
  Eigen::Vector3d operator()(const Eigen::Vector3d& x, const Eigen::Vector3d& mean, double t) const;
  // The same as a map of space.
  Eigen::Isometry3d at(double t, const Eigen::Vector3d& mean) const;
};

}  // namespace toile
