// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/measure/draped_panel.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "geometry/error.h"
#include "pipeline/scene/scene.h"
#include "trimming/face_triangles.h"
#include "trimming/loops.h"
#include "trimming/quadrature.h"

namespace toile {

DrapedPanel draped_panel(const PanelFile& file) {
  const TrimmedSurface *flat = nullptr, *draped = nullptr;
  for (const TrimmedSurface& face : file.panels) {
    for (auto [suffix, found] : {std::pair(flat_suffix, &flat), {draped_suffix, &draped}}) {
      if (!face.name.ends_with(suffix)) continue;
      if (*found) throw InputError(fmt::format("{}: several panels '...{}'; one is measured", file.path, suffix));
      *found = &face;
    }
  }
  if (!flat || !draped)
    throw InputError(
        fmt::format("{}: no pair of panels '... flat' and '... draped', as `toile drape` writes them", file.path));
  TrimmedSurface face = *draped, rest = *flat;
  validate_loops(face);
  validate_loops(rest);
  const double unit = face.metres_per_unit;
  const Eigen::Vector3d up = file.up.value_or(Eigen::Vector3d::UnitZ());
  // Right-handed with up; x and y where up is z.
  const Eigen::Matrix3d level = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const FaceTriangles triangles = face_triangles(face, 1e-4 / unit);
  DrapedPanel out;
  out.points = unit * (level * triangles.mesh.vertices).topRows<2>();
  out.triangles = triangles.mesh.triangles;
  const CutQuadrature points = quadrature(rest);
  Eigen::Vector2d middle(0, 0);
  double parameter_area = 0;
  for (std::size_t k = 0; k < points.weights.size(); ++k) {
    middle += points.weights[k] * points.points[k];
    parameter_area += points.weights[k];
  }
  middle /= parameter_area;
  out.centre = unit * (level * face.surface(middle.x(), middle.y())).head<2>();
  out.flat_area = rest.metres_per_unit * rest.metres_per_unit * measure(rest, trace_trims(rest)).area;
  return out;
}

}  // namespace toile
