// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/scheme/relaxation.h"

#include <algorithm>
#include <cmath>

namespace toile {
namespace {

constexpr int steps_per_halt = 10;
constexpr double smaller_share = 0.7, smallest_share = 0.1;
// Of the step: inertia of 1e5 steps of a sixtieth of a second moves a swing of a second by 1e-8 of what is left of it.
constexpr double whole_share = 1e5, grown_share = 8, held_share = 0.02, smallest_held = 1e-8;
constexpr int least_window = 50, least_trial = 500, windows_at_least = 10;  // of the run so far

// Largest distance between control points that carry cloth.
double largest_move(const MechanicalSystem& system, const Eigen::VectorXd& from, const Eigen::VectorXd& to) {
  const Eigen::VectorXd& mass = system.body->lumped_mass();
  double squared = 0;
  for (Eigen::Index i = 0; i < mass.size(); ++i)
    if (mass[i] > 0) squared = std::max(squared, (to.segment<3>(3 * i) - from.segment<3>(3 * i)).squaredNorm());
  return std::sqrt(squared);
}

void begin(Relaxation& r, bool trial, const Eigen::VectorXd& q) {
  r.trial = trial;
  // A trial lasts as long at small steps as at large ones.
  const int trial_steps = static_cast<int>(least_trial / r.dt_share);
  r.length = trial ? std::max(trial_steps, r.steps) : std::max(least_window, r.steps / windows_at_least);
  r.count = 0;
  r.moved = 0;
  r.halts_before = r.halts;
  r.from = q;
}

}  // namespace

void restart(Relaxation& r) {
  r.remaining = Relaxation().remaining;
  r.from.resize(0);
}

void approach(const MechanicalSystem& system, const StepWork& work, const DynamicState& state, Relaxation& r) {
  ++r.steps;
  r.moved = largest_move(system, work.other.q, state.q);
  r.remaining = r.dt_share >= whole_share ? r.moved : std::numeric_limits<double>::infinity();
  r.dt_share = std::min(grown_share * r.dt_share, whole_share);
}

bool hold_back(Relaxation& r) {
  r.dt_share *= held_share;
  return r.dt_share > smallest_held;
}

bool relax(const MechanicalSystem& system, const StepWork& work, const StepReport& report, double tolerance,
           DynamicState& state, Relaxation& r) {
  if (r.from.size() == 0) begin(r, false, work.other.q);
  ++r.steps;
  ++r.count;
  r.moved = std::max(r.moved, largest_move(system, r.from, state.q));
  if (r.trial && r.moved > tolerance) begin(r, false, state.q);
  const bool over = r.count >= r.length;
  const bool halts = r.trial ? over : report.kinetic <= r.kinetic;
  r.kinetic = halts ? 0 : report.kinetic;
  if (halts) {
    ++r.halts;
    // Where v lacks half of the constraints' impulse: x~ = x + dt v + dt^2/2 a, and the projection adds dt^2 a_c, so
    // that from rest the cloth goes dt^2/2 (a + a_c).
    if (!system.projection || system.projection->end_velocity())
      state.v.setZero();
    else
      state.v = -0.5 * report.dt * work.constraint;
  }
  if (!over) return halts;
  if (!r.trial && (r.halts - r.halts_before) * steps_per_halt > r.count)
    r.dt_share = std::max(smallest_share, smaller_share * r.dt_share);
  if (r.trial) {
    r.remaining = r.moved;
    begin(r, false, state.q);
  } else if (r.moved > tolerance) {
    begin(r, false, state.q);
  } else if (halts) {  // let go from rest
    ++r.trials;
    begin(r, true, state.q);
  }
  return halts;
}

}  // namespace toile
