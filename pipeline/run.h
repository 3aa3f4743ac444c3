// The step loop: from the start to `until`, frame by frame, with energy and finiteness watched.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "analysis/dynamics/time_step.h"
#include "pipeline/system.h"

namespace toile {

enum class RunExit { ok, solver_failed, check_failed, interrupted };
const char* name(RunExit exit);  // "ok", "solver", "check", "interrupted", as in report.json

// A state as frames show it.
struct RunFrame {
  int number = 0;
  double time = 0;
  const System& system;
  const Eigen::VectorXd& q;         // 3 n [m]
  const Eigen::VectorXd& velocity;  // 3 n [m/s]
};

struct RunProgress {
  double time = 0, until = 0, dt = 0;
  int steps = 0, frames = 0;
};

struct RunHooks {
  std::function<void(const RunFrame&)> frame;        // at 0, at every multiple of `every`, at `until`; in order
  std::function<void(const RunProgress&)> progress;  // after each step
  std::function<bool()> stop;                        // asked after each step: finish now, exit interrupted
};

struct EnergyBalance {
  double kinetic = 0;                                    // J, in the middle of the last step
  double membrane = 0, bending = 0, limit = 0;           // J, now; limit: of the strain limits
  double start = 0;                                      // J, kinetic and elastic at the start
  double load_work = 0, drag_work = 0, motion_work = 0;  // J, since the start
  double gravity = 0;                                    // J, potential against the start
  double injected = 0;  // J, largest rise of the balance above the start, 0 where it never rose
  double elastic() const { return membrane + bending + limit; }
  double now() const { return kinetic + elastic(); }
  // What drag and projection took.
  double dissipated() const { return start + load_work + motion_work - now(); }
};

struct RunResult {
  RunExit exit = RunExit::ok;
  std::string reason;  // why the run isn't ok: what, where, what to change
  int frames = 0, steps = 0, redone_steps = 0;
  double time = 0;
  double dt_min = 0, dt_max = 0, dt_last = 0;
  TimeStepBound bound;  // the last one evaluated
  EnergyBalance energy;
  double iterations_sum = 0;
  int iterations_max = 0, unconverged_steps = 0;
  ProjectionReport last_projection;
  double wall_seconds = 0, force_seconds = 0, projection_seconds = 0, bound_seconds = 0, frame_seconds = 0;
  std::unique_ptr<System> system;  // of the last state
  DynamicState state;
  std::vector<std::string> warnings;
};

// Steps land on frame times and release times. With `dt` unset the step is 0.9 of the eigenvalue bound of the present
// state, evaluated anew every 100 steps and when the cloth has grown much tauter.
//   (1) every number of an accepted step is finite;
//   (2) kinetic + elastic energy less the work of loads, drag and moved pins, all in the middle of the step, rises from step
//       to step by no more than 5 % of the energy turned over so far, and in all by no more than 20 %, far less than an
//       unstable step soon does.
//       A step that breaks this is redone with half the step; the planned step is halved ten times at most, then the
//       run ends as solver_failed at the last accepted state.
// The step is deterministic: no decision depends on time of day, addresses or thread count.
RunResult run(const Build& build, const RunHooks& hooks = {});

// The first system and its step bound, for a dry run. Times of the frames of a scene.
std::vector<double> frame_times(const Scene& scene);
double planned_step(const Scene& scene, const TimeStepBound& bound);

// "panel 'front', cell (3, 4), u in [0.3, 0.4], v in [0.4, 0.5]".
std::string describe_cell(const Build& build, const ShellModel::Cell& cell);

}  // namespace toile
