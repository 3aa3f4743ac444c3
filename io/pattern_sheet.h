// SPDX-License-Identifier: GPL-3.0-or-later
// A panel laid out on paper, for drawings and texture coordinates.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "geometry/nurbs_surface.h"

namespace toile {

// Orthonormal, seen from the side that S_u x S_v points to. A panel in a coordinate plane keeps its axes, so that a
// drawing shows the file's own coordinates.
struct DrawingPlane {
  Eigen::Vector3d right, up;
  Eigen::Vector2d operator()(const Eigen::Vector3d& x) const { return {x.dot(right), x.dot(up)}; }
};

// Nothing where control points leave the plane by more than a millionth of the net's size.
std::optional<DrawingPlane> drawing_plane(const NurbsSurface& surface);

// Parameters to the sheet, in the unit of the net, y upwards: a flat panel at its true size and shape; of a curved one
// the parameters, stretched to the surface's mean lengths. The surface must outlive the sheet.
class PatternSheet {
 public:
  explicit PatternSheet(const NurbsSurface& surface);
  Eigen::Vector2d operator()(const Eigen::Vector2d& uv) const;
  bool true_shape() const { return plane_.has_value(); }

 private:
  const NurbsSurface* surface_;
  std::optional<DrawingPlane> plane_;
  Eigen::Vector2d stretch_{1, 1};
};

}  // namespace toile
