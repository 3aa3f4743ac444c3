// SPDX-License-Identifier: GPL-3.0-or-later
// Panels against the body that shall wear them: how large it is where, and how much of them lies in it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "io/triangle_mesh.h"

namespace toile {

// The longest closed line in which the plane y = height cuts the mesh: the trunk, arms left out. Length 0 where it cuts
// nothing.
struct TrunkSection {
  double girth = 0;              // unit of the mesh
  Eigen::Vector2d centre{0, 0};  // (x, z), mean of the line's points
};
TrunkSection trunk_section(const TriangleMesh& mesh, double height);

// Of the volume that a closed mesh holds; the middle of its box where it holds none.
Eigen::Vector3d centre_of_mass(const TriangleMesh& mesh);

// How many of the points lie inside a closed mesh: a line from each along z crosses it an odd number of times.
int count_inside(const TriangleMesh& mesh, const std::vector<Eigen::Vector3d>& points);

// How often a closed polygon of (x, z) runs around a centre, with its sense.
double turns_around(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& centre);

}  // namespace toile
