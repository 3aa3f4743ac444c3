// SPDX-License-Identifier: GPL-3.0-or-later
// The energies of a run, and the watch over them: no step may make energy.
#pragma once

#include <string>

#include "analysis/model/energy_parts.h"
#include "analysis/scheme/verlet.h"
#include "geometry/fields.h"

namespace toile {

struct EnergyBalance {
  double kinetic = 0;                                    // J, where the last step's velocity obeys the constraints
  EnergyParts stored;                                    // J, now: the potentials', and "limit" of the strain limits
  double start = 0;                                      // J, kinetic and elastic at the start
  double load_work = 0, drag_work = 0, motion_work = 0;  // J, since the start
  double gravity = 0;                                    // J, potential against the start
  double injected = 0;  // J, largest rise of the balance above the start, 0 where it never rose
  double elastic() const { return stored.total(); }
  double now() const { return kinetic + elastic(); }
  // What drag took, and with it the step: damping by the strain limit, or less than nothing where energy rose.
  double dissipated() const { return start + load_work + motion_work - now(); }
  double numerical() const { return dissipated() + drag_work; }
};
void fields(auto& archive, Like<EnergyBalance> auto& e) {
  archive(e.kinetic, e.stored, e.start, e.load_work, e.drag_work, e.motion_work, e.gravity, e.injected);
}

// What the watch knows from the steps before.
struct EnergyWatch {
  double exchanged = 0;  // J, the most energy that was at work so far: rises are judged as parts of it
  double balance = 0;    // J, energy now that no work explains
  double trough = 0;     // J, lowest balance since a step was refused
  double rounding = 0;   // J, below what a rise may be rounding
  double kick = 0;       // J, of the last accepted step: what a smaller step may seem to gain
};
void fields(auto& archive, Like<EnergyWatch> auto& w) {
  archive(w.exchanged, w.balance, w.trough, w.rounding, w.kick);
}

// Why the step that `report` tells of can't be accepted after `before`; empty where it can, and then the watch moves
// on.
//   (1) its numbers are finite;
//   (2) kinetic + elastic energy less the work of loads, drag and moved pins, in the middle of the step or at its end
//       (StepReport::at_end), rises by no more than 5 % of the energy exchanged so far, and in all by no more than 20
//       %;
//   (3) `careful`: by no more than half a percent since a step was last refused. For steps that follow a bound.
// `dt_before`: of the step before [s]; a smaller step may seem to gain that step's kick.
std::string why_refused(EnergyWatch& watch, const EnergyBalance& before, const StepReport& report, double dt_before,
                        bool careful);

// The balance after an accepted step.
void add_step(EnergyBalance& energy, const StepReport& report, const EnergyWatch& watch);

// Kinetic energy below what rounding makes [J]: of cloth that would cross its own distance from the origin in 1e8 s, or
// that moves by the rounding of its places in a step. Without loads there is nothing else to compare a rise with.
double rounding_energy(const MechanicalSystem& system, const Eigen::VectorXd& q, double dt);

}  // namespace toile
