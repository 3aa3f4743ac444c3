// SPDX-License-Identifier: GPL-3.0-or-later
// Obstacles given by formulas, each moved rigidly.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <vector>

#include "analysis/contact/obstacle.h"

namespace toile {

// Pose at a time [s], against the shape as described. Null: still.
using RigidMotion = std::function<Eigen::Isometry3d(double)>;

// All that lies behind the plane through `point`, against `normal`.
struct PlaneShape {
  Eigen::Vector3d point{0, 0, 0}, normal{0, 0, 1};
};
struct SphereShape {
  Eigen::Vector3d centre{0, 0, 0};
  double radius = 1;
};
// Flat ends at `from` and `to`; their rims are sharp, as 128 chords.
struct CylinderShape {
  Eigen::Vector3d from{0, 0, 0}, to{0, 0, 1};
  double radius = 1;
};
// All that is within `radius` of the line from `from` to `to`.
struct CapsuleShape {
  Eigen::Vector3d from{0, 0, 0}, to{0, 0, 1};
  double radius = 1;
};
// Edges along the axes of `turned`.
struct BoxShape {
  Eigen::Vector3d centre{0, 0, 0}, size{1, 1, 1};
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
};
// From the circle of `radius` around `base` to the tip; the tip and the rim are sharp.
struct ConeShape {
  Eigen::Vector3d base{0, 0, 0}, tip{0, 0, 1};
  double radius = 1;
};

// Throws GeometryError where a length isn't positive or a number isn't finite.
std::unique_ptr<Obstacle> make_obstacle(const PlaneShape& shape, ObstacleOptions options, RigidMotion motion = nullptr);
std::unique_ptr<Obstacle> make_obstacle(const SphereShape& shape, ObstacleOptions options,
                                        RigidMotion motion = nullptr);
std::unique_ptr<Obstacle> make_obstacle(const CylinderShape& shape, ObstacleOptions options,
                                        RigidMotion motion = nullptr);
std::unique_ptr<Obstacle> make_obstacle(const CapsuleShape& shape, ObstacleOptions options,
                                        RigidMotion motion = nullptr);
std::unique_ptr<Obstacle> make_obstacle(const BoxShape& shape, ObstacleOptions options, RigidMotion motion = nullptr);
std::unique_ptr<Obstacle> make_obstacle(const ConeShape& shape, ObstacleOptions options, RigidMotion motion = nullptr);

}  // namespace toile
