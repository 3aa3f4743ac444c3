// SPDX-License-Identifier: GPL-3.0-or-later
// One contact: a point of the cloth that may not come nearer to another than the offset.
#pragma once

#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

namespace toile {

constexpr double least_offset = 1e-5;  // m, that displacements are compared with where nothing has a thickness

//   y = sum value_k x_k + constant over nodes;   normal . (y - target) - offset >= 0
// with y the point of the cloth (of self-contact: the vector between its two points, and target 0).
struct ContactRow {
  std::array<int, 4> key{};  // ContactKind, two features of cloth or obstacle, obstacle (-1: the cloth itself)
  std::vector<std::pair<int, double>> nodes = {};
  std::vector<std::pair<int, double>> vertices = {};  // of the proxy, by which the nodes are reached
  Eigen::Vector3d constant{0, 0, 0};                  // what fixed control points add
  Eigen::Vector3d fixed_velocity{0, 0, 0};            // and to the velocity
  Eigen::Vector3d normal{0, 0, 1}, target{0, 0, 0}, anchor{0, 0, 0};
  Eigen::Vector3d obstacle_move{0, 0, 0};  // m, of the obstacle's material there in the step
  double offset = 0, friction = 0;
  double chord = 0;       // m, the part of the offset that is chord error
  double distance = 0;    // m, at the start of the step
  double bias = 0;        // m, <= 0: what is left to be pushed out later
  double advance = 0;     // m, that what starts too near is moved off in the step: the contact's work on it
  double weight = 0;      // sum value^2 / mass [1/kg]
  double compliance = 0;  // m per impulse [1/kg]
  int feature = 0;        // of the obstacle
  int side = 1;           // -1: on the inner side of a surface with two
  // Impulses [kg m]: displacement of node k by them is value_k / mass_k times.
  double push = 0;
  Eigen::Vector3d drag{0, 0, 0};
  double velocity_push = 0;  // and times 1/s
  Eigen::Vector3d velocity_drag{0, 0, 0};
};

}  // namespace toile
