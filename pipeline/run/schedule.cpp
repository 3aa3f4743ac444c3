// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/run/schedule.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace toile {

std::optional<double> Schedule::next_frame() const {
  if (!open(scene.until)) return std::nullopt;
  double k = std::max(0.0, std::floor(t / scene.every) - 1);
  while (!open(k * scene.every)) ++k;
  const double time = k * scene.every;
  return time < scene.until * (1 - 1e-9) ? time : scene.until;
}

std::optional<double> Schedule::next_target() const {
  std::optional<double> next = next_frame();
  for (const ScenePin& pin : scene.pins) {
    if (next && pin.release && *pin.release > 0 && open(*pin.release)) next = std::min(*next, *pin.release);
  }
  return next;
}

double motion_done(const Scene& scene) {
  double t = 0;
  for (const ScenePin& pin : scene.pins) {
    if (pin.move) t = std::max(t, pin.release ? std::min(*pin.release, pin.move->end) : pin.move->end);
    if (pin.release) t = std::max(t, *pin.release);
  }
  for (const SceneObstacle& obstacle : scene.obstacles) {
    if (obstacle.move) t = std::max(t, obstacle.move->end);
    if (obstacle.morph) t = std::max(t, obstacle.morph->end);
    if (!obstacle.times.empty()) t = std::max(t, obstacle.times.back());
  }
  return t;
}

std::vector<double> frame_times(const Scene& scene) {
  if (!std::isfinite(scene.until)) throw std::logic_error("a run until rest has no last frame");
  std::vector<double> times;
  for (int k = 0;; ++k) {
    const double t = k * scene.every;
    if (t >= scene.until * (1 - 1e-9)) break;
    times.push_back(t);
  }
  times.push_back(scene.until);
  return times;
}

}  // namespace toile
