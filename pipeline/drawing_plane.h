// Two axes for drawing a flat panel.
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

}  // namespace toile
