// SPDX-License-Identifier: GPL-3.0-or-later
// Places in messages about trims.
#pragma once

#include <string>

#include "geometry/text.h"
#include "geometry/trimmed_surface.h"

namespace toile {

inline std::string point_text(const Eigen::Vector2d& uv) {
  return "(u, v) = (" + text(uv.x()) + ", " + text(uv.y()) + ")";
}

// "skirt.igs:412: entity 144: panel 'front', loop 0, curve 2" with the file's numbers.
inline std::string place_name(const TrimmedSurface& surface) {
  return (surface.source.empty() ? "" : surface.source + ": ") + "panel '" + surface.name + "'";
}
inline std::string place_name(const TrimmedSurface& surface, const TrimLoop& loop, const TrimCurve* curve = nullptr) {
  return place_name(surface) + ", loop " + std::to_string(loop.index) +
         (curve == nullptr ? "" : ", curve " + std::to_string(curve->index));
}

}  // namespace toile
