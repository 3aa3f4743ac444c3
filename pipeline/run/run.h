// SPDX-License-Identifier: GPL-3.0-or-later
// A run: from the start to `until`, frame by frame, with energy and finiteness watched. It can be stepped from outside.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/scheme/relaxation.h"
#include "analysis/scheme/time_step.h"
#include "geometry/fields.h"
#include "pipeline/build/system.h"
#include "pipeline/run/energy_watch.h"
#include "pipeline/run/schedule.h"
#include "pipeline/run/step_control.h"

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

// Everything needed to resume bit for bit, and nothing that depends on the clock.
struct RunState {
  DynamicState state;
  double assembled = 0;  // s, time whose pins hold
  double done = -1;      // s, last frame or release time that is dealt with; none at first
  StepControl control;
  EnergyWatch watch;
  bool relaxing = false;  // on the way to rest: without drag
  Relaxation relaxation;
  PathPoint path;  // where loads grow in steps
  Sewing sewing;
  double sewn = 0;  // s, when that was done; 0: not yet, or from the start
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

void fields(auto& archive, Like<RunState> auto& s) {
  archive(s.state, s.assembled, s.done, s.control, s.watch, s.relaxing, s.relaxation, s.path, s.sewing, s.sewn,
          s.frames, s.steps, s.redone_steps, s.frame_times, s.dt_min, s.dt_max, s.dt_last, s.bound, s.energy,
          s.iterations_sum, s.iterations_max, s.unconverged_steps, s.last_projection, s.warnings);
}

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
  ContactProjection::Counts former_contact;  // of systems before the present one
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

// How far material points may still swing when let go at the end of a run until rest [m].
double rest_tolerance(const Build& build);

// Steps land on frame times and release times (Schedule). With `dt` unset the step is 0.9 of the stable step of the
// present state, asked for anew and scaled by StepControl. A `dt` of the scene that is more than is stable at the
// start, or proves too large, is held to the stable step likewise.
//   (1) every accepted step passes EnergyWatch; one that doesn't is redone with half the step, ten times at most, then
//       the run ends as solver_failed at the last accepted state;
//   (2) a finished run whose energy rose by more than Scene::energy_gain of the most that was exchanged is
//       check_failed;
//   (3) no decision depends on time of day, addresses or thread count.
// Until rest: without drag, halted at each peak of the kinetic energy; time is that of no real motion. Once all motions
// and releases of pins are over, the run ends where `Relaxation::remaining` is within rest_tolerance(), with a frame of
// its own, or as check_failed after max_steps.
class Run {
 public:
  // `start`: what assemble(build, 0, hooks.workers) gave; null: assembled here. Nothing is done before the first step.
  // `build` must outlive the run.
  explicit Run(const Build& build, RunHooks hooks = {}, std::unique_ptr<System> start = nullptr);
  // Goes on from a run of the same build (read_checkpoint): the end is that of a run that never stopped, to the bit,
  // unless `until` or `every` are others now. Throws InputError where `until` has passed already.
  Run(const Build& build, RunHooks hooks, RunResult from);
  ~Run();
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  // True once there is nothing to do: the end is reached, the cloth is at rest, or the run can't go on.
  bool finished() const;
  // One step of the cloth, and the frames and releases that its end brings. The first call also makes the start with
  // its frame. Nothing once finished.
  void step();
  const RunResult& now() const;  // as far as it is
  // What the run comes to: the last state, and the verdict on it. Ends the run.
  RunResult finish();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

// A whole run: steps until it is finished.
RunResult run(const Build& build, const RunHooks& hooks = {});
RunResult run(const Build& build, std::unique_ptr<System> start, const RunHooks& hooks = {});
RunResult run(const Build& build, RunResult from, const RunHooks& hooks = {});
void require_time_left(const Build& build, const RunState& state);

// Part of the stable step that a run takes; the step [s], before the control's scale.
double step_share(const System& system);
double planned_step(const Scene& scene, const TimeStepBound& bound, double share);

// "panel 'front', cell (3, 4), u in [0.3, 0.4], v in [0.4, 0.5]".
std::string describe_cell(const Build& build, const Cell& cell);

}  // namespace toile
