// SPDX-License-Identifier: GPL-3.0-or-later
// Pins that contradict the strain limit, found before a step is taken.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "pipeline/build/build.h"

namespace toile {

// Where a pin (its number in the scene) has taken a point [m] that it held at `from`, at a time [s].
using MovedPoint = std::function<Eigen::Vector3d(int pin, const Eigen::Vector3d& from, double time)>;

// Throws InputError where the scene moves two pins of a flat panel, from time t on, farther apart than the cloth
// between them reaches within the strain limit. Knows nothing of curved panels, nor of material that lies around a hole
// or a bay.
void refuse_out_of_reach(const Build& build, double t, const MovedPoint& moved);

}  // namespace toile
