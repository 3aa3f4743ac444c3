// SPDX-License-Identifier: GPL-3.0-or-later
// Triangle meshes from files: bodies and other obstacles.
#pragma once

#include <filesystem>

#include "geometry/triangle_mesh.h"

namespace toile {

// OBJ, PLY, STL, glTF and what else assimp reads, in the unit and the axes of the file; vertices at one place are one
// vertex. Throws InputError where the file can't be read or holds no triangle.
TriangleMesh read_mesh(const std::filesystem::path& path);

}  // namespace toile
