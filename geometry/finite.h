// SPDX-License-Identifier: GPL-3.0-or-later
// The door in front of every predicate: a number that isn't finite has no sign, no side and no order.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <string>

#include "geometry/error.h"
#include "geometry/text.h"

namespace toile {

// Throws GeometryError ("a point is at (nan, 0.5), must be finite") where a number isn't finite.
inline void require_finite(double x, const char* what) {
  if (!std::isfinite(x)) throw GeometryError(std::string(what) + " is " + text(x) + ", must be finite");
}
inline void require_finite(const Eigen::Vector2d& x, const char* what) {
  if (!x.allFinite())
    throw GeometryError(std::string(what) + " is at (" + text(x.x()) + ", " + text(x.y()) + "), must be finite");
}
inline void require_finite(const Eigen::Vector3d& x, const char* what) {
  if (!x.allFinite())
    throw GeometryError(std::string(what) + " is at (" + text(x.x()) + ", " + text(x.y()) + ", " + text(x.z()) +
                        "), must be finite");
}

}  // namespace toile
