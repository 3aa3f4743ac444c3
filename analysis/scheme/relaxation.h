// SPDX-License-Identifier: GPL-3.0-or-later
// Static equilibrium by dynamic relaxation with kinetic damping: steps without drag, halted whenever the kinetic energy
// has passed a peak. [Cundall 1976; Barnes 1999]
#pragma once

#include <Eigen/Core>
#include <limits>

#include "analysis/scheme/verlet.h"
#include "geometry/fields.h"

namespace toile {

// Rest is judged by displacement. Halts alone say nothing: fast waves have peaks too, and each halt holds up the slow
// swing that still has far to go. So once the cloth moves little from window to window (of a tenth to a fifth of all
// steps so far) it is let go: it swings without halts for as many steps as it took to get there.
//   (1) `remaining` is the largest distance of any control point from where it was let go, at any time of the swing; no
//       material point goes farther, as functions are nonnegative and sum to 1;
//   (2) what was A away from its rest swings by 2 A, and by A within a quarter of its period: `remaining` is no less
//       than the distance that is left of every swing whose quarter lasts no longer than the trial;
//   (3) a trial that goes beyond the tolerance ends at once, and the next peak halts the slow swing that it set free.
struct Relaxation {
  int steps = 0, halts = 0, trials = 0;
  double remaining = std::numeric_limits<double>::infinity();  // m, of the last whole trial

  double dt_share = 1;  // of the stable step that should be taken: less where waves that a step hardly resolves go on

  bool trial = false;         // swinging free
  int length = 0, count = 0;  // steps of the window or trial at hand, and how many are done
  double moved = 0;           // m, in it
  double kinetic = 0;         // J, of the step before, 0 after a halt
  int halts_before = 0;       // at its start
  Eigen::VectorXd from;       // control points at its start; empty: none began
};
void fields(auto& archive, Like<Relaxation> auto& r) {
  archive(r.steps, r.halts, r.trials, r.remaining, r.dt_share, r.trial, r.length, r.count, r.moved, r.kinetic,
          r.halts_before, r.from);
}

// Judges the step that led to `state` and halts the cloth where the kinetic energy fell: the next step starts from rest
// (v_half = 0, constraints at work). `work` and `report` are of that step. Returns whether it halted.
bool relax(const MechanicalSystem& system, const StepWork& work, const StepReport& report, double tolerance,
           DynamicState& state, Relaxation& relaxation);

// The same for a step of ImplicitScheme::equilibrate, which takes beta = dt dt_share: the share grows as long as steps
// are accepted; once inertia holds nothing back, `remaining` is how far a step still went.
void approach(const MechanicalSystem& system, const StepWork& work, const DynamicState& state, Relaxation& relaxation);
// After one that found no balance: a smaller share; false where that is not tried any more.
bool hold_back(Relaxation& relaxation);

// Begins the judgement anew, as after a pin was released or moved.
void restart(Relaxation& relaxation);

}  // namespace toile
