// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/build/iges_body.h"

#include <fmt/format.h>

#include <algorithm>

#include "geometry/error.h"
#include "geometry/mesh_joining.h"
#include "io/panel_file.h"
#include "trimming/face_triangles.h"
#include "trimming/loops.h"

namespace toile {

IgesBody read_iges_body(const std::filesystem::path& path, double chord_error) {
  const PanelFile file = read_panels(path);
  require_panels(file);
  IgesBody out;
  out.metres_per_unit = file.metres_per_unit;
  out.warnings = file.warnings;
  for (const std::string& reason : file.refused) out.warnings.push_back("left out: " + reason);
  // A third for the faces; their borders may be twice that apart where they are joined, as each is off by a third, and
  // vertices that become one move by half of one.
  const double third = chord_error / file.metres_per_unit / 3, millimetres = 1000 * file.metres_per_unit;
  std::vector<Eigen::Vector3d> vertices;
  std::string first_reason;
  for (TrimmedSurface face : file.panels) {
    try {
      validate_loops(face);
      const FaceTriangles triangles = face_triangles(face, third);
      if (triangles.chord_error > third)
        out.warnings.push_back(
            fmt::format("face '{}' ({}): its triangles are up to {:.3g} mm off, as more of them than the {} there are "
                        "would be too many; a chord_error of {:.3g} mm accepts that",
                        face.name, face.source, millimetres * triangles.chord_error, triangles.mesh.triangles.size(),
                        3 * millimetres * triangles.chord_error));
      const int first = static_cast<int>(vertices.size());
      for (Eigen::Index k = 0; k < triangles.mesh.vertices.cols(); ++k)
        vertices.emplace_back(triangles.mesh.vertices.col(k));
      for (const Triangle& t : triangles.mesh.triangles)
        out.mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    } catch (const GeometryError& error) {
      if (first_reason.empty()) first_reason = error.what();
      out.warnings.push_back(fmt::format("a face is left out: {}", error.what()));
    }
  }
  if (vertices.empty()) throw GeometryError(first_reason);
  out.mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t k = 0; k < vertices.size(); ++k) out.mesh.vertices.col(static_cast<Eigen::Index>(k)) = vertices[k];
  out.mesh = join_borders(std::move(out.mesh), std::max(2 * third, 2 * file.resolution));
  return out;
}

}  // namespace toile
