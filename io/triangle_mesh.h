// SPDX-License-Identifier: GPL-3.0-or-later
// Triangle meshes from files: bodies and other obstacles.
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <vector>

namespace toile {

struct TriangleMesh {
  Eigen::Matrix3Xd vertices;  // unit and axes of the file
  std::vector<std::array<int, 3>> triangles;
};

// OBJ, PLY, STL, glTF and what else assimp reads; vertices at one place are one vertex. Throws InputError where the
// file can't be read or holds no triangle.
TriangleMesh read_mesh(const std::filesystem::path& path);

}  // namespace toile
