// SPDX-License-Identifier: GPL-3.0-or-later
// A shaded picture of a frame: the cloth coloured by strain, for the eye.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "geometry/trimmed_surface.h"
#include "io/frame.h"

namespace toile {

struct PreviewOptions {
  int width = 900, height = 700;                  // pixels
  Eigen::Vector3d up{0, 0, 1};                    // scene axis that points up: against gravity
  std::optional<Eigen::Vector3d> towards_camera;  // from the cloth to the eye; unset: where the cloth looks largest
  std::optional<Interval> range;                  // of the strain scale; unset: what the picture shows, and zero
  std::string title;                              // small line of text in the corner
};

// False where the program was built without Embree or stb (TOILE_PREVIEW); preview_png then throws OutputError.
bool preview_available();

// PNG bytes. Bodies are shown plain beside the cloth. Colour is the larger of weft and warp strain
// (FrameFields::strain; grey where that is empty), the scale (ColourScale) stands beside it. Trims and knot lines are
// drawn thin. The same frame gives the same bytes on any number of threads. Throws OutputError where there is nothing
// to draw.
std::string preview_png(const Frame& frame, const PreviewOptions& options = {});

}  // namespace toile
