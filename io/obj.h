// SPDX-License-Identifier: GPL-3.0-or-later
// Triangles as Wavefront OBJ.
#pragma once

#include <string>
#include <string_view>

#include "io/frame.h"

namespace toile {

// The material of all panels: metres, scene axes; an object (o) and group (g) per panel with smooth normals and texture
// coordinates of pattern_coordinates(), all of the material "cloth" of the file `material_file`.
std::string format_obj(const Frame& frame, std::string_view material_file);

// That file.
std::string format_mtl();

}  // namespace toile
