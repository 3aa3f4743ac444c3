// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/run/step_control.h"

#include <algorithm>
#include <cmath>

namespace toile {
namespace {

constexpr int bound_usually = 100, bound_rarely = 400;  // steps; the bound costs some 25 forces
constexpr double bound_holds = 0.01;  // change of the step, from one bound to the next, far less than the safety takes
constexpr double stiffening = 0.2;    // of the cloth since the last bound: nearly what the safety takes
constexpr int most_patience = 10000, least_patience = 10;  // steps
constexpr double damped_scale = 0.8, smallest_damped = 0.25;
constexpr double smallest_scale = 1.0 / 1024;  // ten halvings of the planned step

}  // namespace

bool StepControl::stiffened() const {
  return stiffer(strain, strain_at_bound, stiffening);
}

bool StepControl::begin_bound() {
  const bool in_turn = scale == 1 && bound_is_due();
  steps_since_bound = 0;
  bound_every = bound_usually;
  return in_turn;
}

void StepControl::settle_interval(int interval_before, double before, double dt) {
  if (std::abs(dt / before - 1) <= bound_holds) bound_every = std::min(2 * interval_before, bound_rarely);
}

void StepControl::accept(const StrainRange& now, bool damped) {
  if (damped && scale > smallest_damped) scale = std::max(smallest_damped, damped_scale * scale);
  // Larger again, but later each time that this proved too early.
  if (++calm >= (unmet ? least_patience : patience)) {
    calm = 0;
    scale = std::min(1.0, 2 * scale);
    if (scale == 1) unmet = false;
  }
  ++steps_since_bound;
  strain = now;
  if (stiffened()) steps_since_bound = bound_every;
}

void StepControl::refuse(bool first_try, bool no_balance) {
  calm = 0;
  if (first_try) unmet = no_balance;
  if (first_try && !no_balance) patience = std::min(2 * patience, most_patience);
}

bool StepControl::exhausted() const {
  return scale <= smallest_scale;
}

}  // namespace toile
