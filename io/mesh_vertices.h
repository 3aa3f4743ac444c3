// SPDX-License-Identifier: GPL-3.0-or-later
// What files of triangles say of a panel's vertices.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "io/frame.h"

namespace toile {

struct MeshVertices {
  std::vector<Eigen::Vector3d> position;  // m, scene axes
  std::vector<Eigen::Vector3d> normal;    // of the surface, on the side of S_u x S_v; (0, 0, 1) where it has none
  std::vector<Eigen::Vector2d> texture;   // of pattern_coordinates()
};

// Texture coordinates: the panels' patterns laid out in the unit square, all at one scale, none over another, y upwards
// from the lower left corner.
//   (1) every coordinate lies in [0, 1], and the layout reaches from 0 to 1 one way at least;
//   (2) a flat panel has its true shape: what is square on the texture is square on the cloth;
//   (3) panels with one `flat` have the same place: a drape and its pattern share their coordinates;
//   (4) they depend on patterns and triangles alone, so they stay the same from frame to frame.
std::vector<std::vector<Eigen::Vector2d>> pattern_coordinates(const Frame& frame);

// Per panel, in the order of its TrimmedTriangles.
std::vector<MeshVertices> mesh_vertices(const Frame& frame);

}  // namespace toile
