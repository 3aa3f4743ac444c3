// SPDX-License-Identifier: GPL-3.0-or-later
// A body whose surface an IGES file holds.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace toile {

struct IgesBody {
  TriangleMesh mesh;  // unit and axes of the file; faces joined at their edges, each facing as the file has it
  double metres_per_unit = 1;
  std::vector<std::string> warnings;  // of the file, and what of it is missing
};

// Every face as triangles within `chord_error` [m] of it. Throws InputError and GeometryError as read_panels does.
IgesBody read_iges_body(const std::filesystem::path& path, double chord_error);

}  // namespace toile
