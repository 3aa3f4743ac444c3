// SPDX-License-Identifier: GPL-3.0-or-later
// How large the next step is: a share of what is planned, and when the stable step is asked for anew.
#pragma once

#include "analysis/fabric/stiffening.h"
#include "analysis/scheme/time_step.h"
#include "geometry/fields.h"

namespace toile {

inline constexpr double step_safety = 0.9;  // of the stable step

// Kept from step to step.
//   (1) The bound is asked for anew every 100 steps, less often, up to every 400, where it hardly changes, and at once
//       where strain has made the cloth stiffer by a fifth.
//   (2) A refused step halves the scale, ten times at most; it doubles again after 100 quiet steps, after twice as many
//       each time that a step was refused. Where the step found no balance, as where cloth first meets something, it
//       doubles after ten, and is no more patient for that.
//   (3) A step whose projection had to damp was too large for accuracy: the next are smaller by a fifth, down to a
//       quarter of the plan.
struct StepControl {
  double scale = 1;                            // of the planned step
  int calm = 0, patience = 100;                // steps since one was refused or the scale rose; until it rises
  bool unmet = false;                          // the last refusals were for want of balance: less patience is enough
  int steps_since_bound = 0, bound_every = 0;  // steps
  StrainRange strain, strain_at_bound;         // now, and when the bound was asked for

  bool bound_is_due() const { return steps_since_bound >= bound_every; }
  bool stiffened() const;  // since the bound was asked for
  // The bound comes: resets the count. Returns whether it came in its turn, with the full step.
  bool begin_bound();
  // What came in its turn was `dt`, after `before` [s]: rarely changing bounds are asked for less often.
  void settle_interval(int interval_before, double before, double dt);

  void accept(const StrainRange& now, bool damped);
  // `first_try`: not after another refusal of the same step. `no_balance`: not for its energy.
  void refuse(bool first_try, bool no_balance = false);
  bool exhausted() const;  // no smaller step is tried
};
void fields(auto& archive, Like<StepControl> auto& c) {
  archive(c.scale, c.calm, c.patience, c.unmet, c.steps_since_bound, c.bound_every, c.strain, c.strain_at_bound);
}

}  // namespace toile
