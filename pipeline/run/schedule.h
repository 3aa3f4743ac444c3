// SPDX-License-Identifier: GPL-3.0-or-later
// The times that steps land on: frames and releases of pins.
#pragma once

#include <optional>
#include <vector>

#include "pipeline/scene/scene.h"

namespace toile {

// What of a scene's times is dealt with when the clock shows `t`; `done` is the last frame or release that was, -1
// where there was none.
struct Schedule {
  const Scene& scene;
  double t = 0, done = -1;

  // The next frame that has a time beforehand: multiples of `every`, then `until`; none after the end.
  std::optional<double> next_frame() const;
  // The next time that steps land on; none after the end.
  std::optional<double> next_target() const;

 private:
  bool open(double time) const { return time > done && time >= t; }
};

// When pins and obstacles no longer move and pins are no longer let go [s].
double motion_done(const Scene& scene);

// All frames of a scene with an end.
std::vector<double> frame_times(const Scene& scene);

}  // namespace toile
