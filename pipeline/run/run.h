// SPDX-License-Identifier: GPL-3.0-or-later
// The step loop: from the start to `until`, frame by frame, with energy and finiteness watched.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/scheme/relaxation.h"
#include "analysis/scheme/time_step.h"
#include "pipeline/build/system.h"

namespace toile {

enum class RunExit { ok, solver_failed, check_failed, interrupted, time_limit };
const char* name(RunExit exit);  // "ok", "solver", "check", "interrupted", "time_limit", as in report.json

// A state as frames show it.
struct RunFrame {
  int number = 0;
  double time = 0;
  double dt = 0;  // s, of the last step; 0 before the first
  const System& system;
  const Eigen::VectorXd& q;         // 3 n [m]
  const Eigen::VectorXd& velocity;  // 3 n [m/s]
};

struct RunProgress {
  double time = 0, until = 0, dt = 0;
  int steps = 0, frames = 0;
};

struct EnergyBalance {
  double kinetic = 0;                                    // J, in the middle of the last step
  EnergyParts stored;                                    // J, now: the potentials', and "limit" of the strain limits
  double start = 0;                                      // J, kinetic and elastic at the start
  double load_work = 0, drag_work = 0, motion_work = 0;  // J, since the start
  double gravity = 0;                                    // J, potential against the start; at the end of a run
  double injected = 0;  // J, largest rise of the balance above the start, 0 where it never rose
  double elastic() const { return stored.total(); }
  double now() const { return kinetic + elastic(); }
  // What drag took, and with it the step: damping by the strain limit, or less than nothing where energy rose.
  double dissipated() const { return start + load_work + motion_work - now(); }
  double numerical() const { return dissipated() + drag_work; }
};

// What the step loop carries from step to step besides the state of the cloth.
struct LoopState {
  double assembled = 0;                        // s, time whose pins hold
  double done = -1;                            // s, last frame or release time that is dealt with; none at first
  double dt_scale = 1;                         // of the planned step
  int calm = 0, patience = 100;                // steps since one was refused or the scale rose; until it rises
  int steps_since_bound = 0, bound_every = 0;  // steps
  StrainRange strain, strain_at_bound;         // now, and when the bound was asked for
  double scale = 0, balance = 0;               // J, energy turned over; unexplained rise
  double trough = 0;                           // J, lowest balance since a step was refused
  double rounding = 0;                         // J, that nobody sees
  double kick = 0;                             // J, of the last accepted step: what a smaller step may seem to gain
};

// All of a run that a later one needs to go on with the same bits, and nothing that depends on the clock. A field more:
// a word in checkpoint.cpp.
struct RunState {
  DynamicState state;
  LoopState loop;
  bool relaxing = false;  // on the way to rest: without drag
  Relaxation relaxation;
  int frames = 0, steps = 0, redone_steps = 0;
  std::vector<double> frame_times;  // s, of the frames so far
  double dt_min = 0, dt_max = 0, dt_last = 0;
  TimeStepBound bound;  // the last one evaluated
  EnergyBalance energy;
  double iterations_sum = 0;
  int iterations_max = 0, unconverged_steps = 0;
  ProjectionReport last_projection;
  std::vector<std::string> warnings;
};

struct RunResult : RunState {
  RunExit exit = RunExit::ok;
  std::string reason;  // why the run isn't ok: what, where, what to change
  double time = 0;
  std::unique_ptr<System> system;  // of the last state
  // What to go on from where that is not the end: before the step that the solver could not make, before the last frame
  // of a run until rest.
  std::optional<RunState> accepted;
  // Of this process alone, which began at `from` [s].
  double from = 0;
  double wall_seconds = 0, force_seconds = 0, projection_seconds = 0, bound_seconds = 0, frame_seconds = 0;
};

struct RunHooks {
  Workers* workers = nullptr;                        // threads of the run; null: the caller's alone
  std::function<void(const RunFrame&)> frame;        // at 0, at every multiple of `every`, at `until`; in order
  std::function<void(const RunProgress&)> progress;  // after each step
  // After the first frame, each step and each later frame: a run may be taken up from here.
  std::function<void(const RunResult&)> resumable;
  std::function<RunExit()> stop;  // asked after each step, so that every run gets ahead; not ok: finish now with this
};

// Potential of a state in the scene's gravity, against the start [J].
double gravity_potential(const Build& build, const Eigen::VectorXd& q);

// So far may material points swing when let go at the end of a run until rest [m].
double rest_tolerance(const Build& build);

// Steps land on frame times and release times. With `dt` unset the step is 0.9 of the eigenvalue bound of the present
// state, evaluated anew every 100 steps, and less often, up to every 400, where it hardly changes, at once where cloth
// is stretched or squeezed so far that it is stiffer by a fifth; where the projection had to damp, less. A `dt` of the
// scene that is more than the bound at the start, or proves too large, is held to the bound likewise.
//   (1) every number of an accepted step is finite;
//   (2) kinetic + elastic energy less the work of loads, drag and moved pins, all in the middle of the step, rises from
//       step to step by no more than 5 % of the energy turned over so far, and in all by no more than 20 %. Steps that
//       follow the bound are refused for half a percent since one was last refused, down to a sixteenth of the bound.
//       A step that breaks this is redone with half the step, ten times at most, then the run ends as solver_failed at
//       the last accepted state. Steps grow again after 100 quiet ones, after twice as many each time.
//   (3) a finished run whose energy rose by more than Scene::energy_gain of the most that was turned over is
//       check_failed.
// Until rest: without drag, halted at each peak of the kinetic energy; time is that of no real motion. Once all motions
// and releases of pins are over, the run ends where `Relaxation::remaining` is within rest_tolerance(), with a frame of
// its own, or as check_failed after max_steps.
// The step is deterministic: no decision depends on time of day, addresses or thread count.
RunResult run(const Build& build, const RunHooks& hooks = {});
// The same with what assemble(build, 0, hooks.workers) gave.
RunResult run(const Build& build, std::unique_ptr<System> start, const RunHooks& hooks = {});

// Goes on from a run of the same build (read_checkpoint): the end is that of a run that never stopped, to the bit,
// unless `until` or `every` are others now. Throws InputError where `until` has passed already.
RunResult run(const Build& build, RunResult from, const RunHooks& hooks = {});
void require_time_left(const Build& build, const RunState& state);

// For a dry run: times of the frames of a scene with an end.
std::vector<double> frame_times(const Scene& scene);
double planned_step(const Scene& scene, const TimeStepBound& bound);

// "panel 'front', cell (3, 4), u in [0.3, 0.4], v in [0.4, 0.5]".
std::string describe_cell(const Build& build, const Cell& cell);

}  // namespace toile
