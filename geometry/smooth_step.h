// SPDX-License-Identifier: GPL-3.0-or-later
// A motion's share done after a share of its time.
#pragma once

#include <algorithm>

namespace toile {

// From 0 to 1 with velocity and acceleration 0 at both ends; 0 before and 1 after.
inline double smooth_step(double time) {
  const double t = std::clamp(time, 0.0, 1.0);
  return t * t * t * (10 + t * (-15 + 6 * t));
}

}  // namespace toile
