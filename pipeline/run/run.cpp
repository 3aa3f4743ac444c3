// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/run/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/clock.h"
#include "geometry/error.h"

namespace toile {
namespace {

constexpr double step_safety = 0.9;   // of the eigenvalue bound
constexpr int bound_every = 100;      // steps; the bound costs some 25 forces
constexpr int bound_rarely = 400;     // steps
constexpr int most_patience = 10000;  // steps
constexpr double bound_holds = 0.01;  // change of the step, from one bound to the next, far less than the safety takes
constexpr double stiffening = 0.2;    // of the cloth since the last bound: nearly what the safety takes
// A step whose projection had to damp was too large for accuracy: the next are smaller by this, down to a share of the
// plan.
constexpr double damped_scale = 0.8, smallest_damped = 0.25;
constexpr double rest_share = 1e-4;            // of the largest panel, of the tolerance of rest
constexpr double smallest_scale = 1.0 / 1024;  // ten halvings of the planned step
// Of the energy turned over: in a step and in all. A step that the bound chooses is made smaller for less, down to a
// share of it, unless the limit is hard, which leaves more in smaller ones.
constexpr double step_rise = 0.05, total_rise = 0.2;
constexpr double small_rise = 0.005, smallest_careful = 1.0 / 16;
constexpr int first_steps = 10;  // little is turned over yet, so that a part of it is nothing

// Kinetic energy that nobody sees: of cloth that would cross its own distance from the origin in 1e8 s, or that moves
// by the rounding of its places in a step. Without loads there is nothing else to compare a rise with.
double rounding_energy(const MechanicalSystem& system, const Eigen::VectorXd& q, double dt) {
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  const double speed = q.lpNorm<Eigen::Infinity>() * (1e-8 + (dt > 0 ? 64 * epsilon / dt : 0));
  return 0.5 * system.node_mass.sum() * speed * speed;
}

class Loop {
 public:
  // Without a system, `from` is a run that has yet to begin.
  Loop(const Build& build, RunResult from, const RunHooks& hooks)
      : build_(build), scene_(build.scene), hooks_(hooks), result_(std::move(from)) {
    result_.from = result_.state.t;
  }
  Loop(const Build& build, std::unique_ptr<System> start, const RunHooks& hooks) : Loop(build, RunResult(), hooks) {
    start_system_ = std::move(start);
  }

  RunResult operator()() {
    if (result_.system) {
      require_time_left(build_, result_);
      // The forces of a run with another kind of end are others.
      if (result_.relaxing != scene_.rest.has_value()) initialise(result_.system->dynamic, result_.state);
    } else {
      begin();
      emit_frame();
      finish_target(0);
    }
    result_.relaxing = scene_.rest.has_value();
    while (const auto target = next_target()) {
      while (result_.exit == RunExit::ok && result_.state.t < *target && !over()) advance(*target);
      if (result_.exit != RunExit::ok) break;
      if (result_.state.t < *target) {
        // Ends before its time. A run that goes on from here has no frame now.
        result_.accepted = RunState(result_);
        if (result_.loop.done < result_.state.t) emit_frame();
        result_.loop.done = result_.state.t;
        break;
      }
      release(*target);
      if (*target == next_frame()) emit_frame();
      finish_target(*target);
    }
    if (result_.exit == RunExit::ok && !result_.last_projection.converged) report_limit();
    if (result_.exit == RunExit::ok && scene_.rest && !at_rest()) report_unrest();
    if (result_.exit == RunExit::ok) check_energy();
    result_.time = result_.state.t;
    result_.energy.gravity = gravity_potential(build_, control_points(*result_.system, result_.state));
    result_.wall_seconds = since(start_);
    return std::move(result_);
  }

 private:
  void begin() {
    result_.system = start_system_ ? std::move(start_system_) : assemble(build_, 0, hooks_.workers);
    result_.warnings = result_.system->warnings;
    warn_of_stiff_limit();
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(build_.start.size());
    result_.state = state_from(*result_.system, build_.start, zero, 0);
    settle();
    result_.last_projection.converged = true;
    const Eigen::VectorXd q = control_points(*result_.system, result_.state);
    Eigen::VectorXd force(q.size());
    const Elastic elastic = internal_force(build_.model->potentials(), q, force, hooks_.workers);
    result_.energy.stored = elastic.energy;
    result_.energy.stored.set("limit", limit_energy());
    result_.energy.start = result_.energy.elastic();
    result_.loop.scale = result_.energy.start;
    result_.loop.strain = elastic.strain;
    evaluate_bound();
    if (scene_.dt) hold_to_bound();
    result_.loop.rounding = rounding_energy(result_.system->dynamic, build_.start, result_.bound.dt);
  }

  // Nets that don't follow the threads lock where rows are stiff. (analysis/README.md, "Which rows")
  void warn_of_stiff_limit() {
    constexpr double much = 100;
    const StrainLimit& limit = scene_.strain_limit;
    if (!limit.on || !limit.stiffness) return;
    for (std::size_t k = 0; k < build_.panels.size(); ++k) {
      const double usual = default_limit_stiffness(build_, static_cast<int>(k));
      if (!(*limit.stiffness > much * usual)) continue;
      result_.warnings.push_back(fmt::format(
          "strain_limit.stiffness is {:.3g} N/m, {:.3g} times what the loads of panel '{}' ask for: nets across "
          "the threads may hardly bend",
          *limit.stiffness, *limit.stiffness / usual, build_.panels[k].name));
    }
  }

  void resumable() const {
    if (hooks_.resumable) hooks_.resumable(result_);
  }
  void finish_target(double t) {
    result_.loop.done = t;
    resumable();
  }

  // Not dealt with yet.
  bool open(double t) const { return t > result_.loop.done && t >= result_.state.t; }
  // The next frame that has a time beforehand; none after the end.
  std::optional<double> next_frame() const {
    if (!open(scene_.until)) return std::nullopt;
    double k = std::max(0.0, std::floor(result_.state.t / scene_.every) - 1);
    while (!open(k * scene_.every)) ++k;
    const double t = k * scene_.every;
    return t < scene_.until * (1 - 1e-9) ? t : scene_.until;
  }
  // The next time that steps land on.
  std::optional<double> next_target() const {
    std::optional<double> next = next_frame();
    for (const ScenePin& pin : scene_.pins) {
      if (next && pin.release && *pin.release > 0 && open(*pin.release)) next = std::min(*next, *pin.release);
    }
    return next;
  }

  bool at_rest() const { return scene_.rest && result_.relaxation.remaining <= tolerance_; }
  // Before its time: at rest, or at the end of the steps that it may take to get there.
  bool over() const { return at_rest() || (scene_.rest && result_.relaxation.steps >= scene_.rest->max_steps); }
  // When pins no longer move and are no longer let go.
  double pins_done() const {
    double t = 0;
    for (const ScenePin& pin : scene_.pins) {
      if (pin.move) t = std::max(t, pin.release ? std::min(*pin.release, pin.move->end) : pin.move->end);
      if (pin.release) t = std::max(t, *pin.release);
    }
    return t;
  }

  void evaluate_bound() {
    LoopState& loop = result_.loop;
    const bool in_turn = loop.dt_scale == 1 && loop.steps_since_bound >= loop.bound_every;
    const double before = result_.bound.dt;
    const int kept = loop.bound_every;
    loop.steps_since_bound = 0;
    loop.bound_every = bound_every;
    const bool held = bounded();
    if (!held && !stiffer(loop.strain, loop.strain_at_bound, stiffening)) return;
    loop.strain_at_bound = loop.strain;
    if (!held) return hold_to_bound();
    result_.bound = ask_for_bound();
    if (in_turn && std::abs(result_.bound.dt / before - 1) <= bound_holds)
      loop.bound_every = std::min(2 * kept, bound_rarely);
  }
  TimeStepBound ask_for_bound() {
    const Clock::time_point start = Clock::now();
    const TimeStepBound bound = bound_of(*result_.system);
    result_.bound_seconds += since(start);
    return bound;
  }

  bool hard_limit() const {
    const StrainLimit& limit = scene_.strain_limit;
    return limit.on && (limit.solver == LimitSolver::lagrange || limit.variant == ProjectionVariant::paper);
  }
  // A step that the scene names is held to the bound once it has proved too large.
  bool bounded() const { return !scene_.dt || result_.bound.dt > 0; }
  double largest_step() const {
    const double planned = planned_step(scene_, result_.bound);
    return scene_.dt && bounded() ? std::min(planned, step_safety * result_.bound.dt) : planned;
  }
  void hold_to_bound() {
    const TimeStepBound bound = ask_for_bound();
    if (!(*scene_.dt > bound.dt)) return;
    result_.bound = bound;
    result_.warnings.push_back(fmt::format(
        "solver.dt = {:.3g} s is more than is stable: {:.3g} s at t = {:.3g} s, by {} in {}; from then on the "
        "steps are smaller",
        *scene_.dt, result_.bound.dt, result_.state.t, result_.bound.bending ? "bending" : "membrane",
        describe_cell(build_, result_.bound.cell)));
  }

  TimeStepBound bound_of(const System& system) const {
    return time_step_bound(*build_.model, *system.map, system.dynamic.node_mass, control_points(system, result_.state),
                           system.dynamic.workers);
  }
  double limit_energy() const {
    const System& system = *result_.system;
    return system.projection ? system.projection->energy(result_.state.x, result_.state.t) : 0;
  }
  void advance(double target) {
    if (result_.loop.steps_since_bound >= result_.loop.bound_every) evaluate_bound();
    double largest = result_.loop.dt_scale * largest_step();
    if (!scene_.dt) largest *= result_.relaxation.dt_share;
    const double left = target - result_.state.t;
    // A remainder of rounding makes no step of its own.
    const double count = std::max(1.0, std::ceil(left / largest * (1 - 1e-9)));
    double dt = left / count;
    if (!(dt > 0) || result_.state.t + dt == result_.state.t) {
      result_.accepted = RunState(result_);
      fail(fmt::format("the step of {:.3g} s is too small to advance the time", dt));
      return;
    }
    for (bool halved = false;; halved = true) {
      const StepReport report = step(result_.system->dynamic, result_.state, dt, work_);
      result_.force_seconds += report.force_seconds;
      result_.projection_seconds += report.projection_seconds;
      const std::string trouble = judge(report);
      if (trouble.empty()) {
        accept(report);
        if (scene_.rest) relax_after(report);
        // The last step of a stretch ends on the target itself, not on a rounded sum.
        if (count == 1 && !halved) result_.state.t = target;
        break;
      }
      if (report.finite) std::swap(result_.state, work_.other);
      if (!halved) result_.accepted = RunState(result_);
      if (!bounded()) hold_to_bound();
      ++result_.redone_steps;
      result_.loop.calm = 0;
      result_.loop.trough = result_.loop.balance;
      if (!halved) result_.loop.patience = std::min(2 * result_.loop.patience, most_patience);
      if (result_.loop.dt_scale <= smallest_scale) {
        fail(fmt::format("{}, even with a step of {:.3g} s", trouble, dt));
        return;
      }
      dt = std::min(dt / 2, largest_step());
      result_.loop.dt_scale /= 2;
    }
    if (hooks_.progress) hooks_.progress({result_.state.t, scene_.until, dt, result_.steps, result_.frames});
    result_.accepted.reset();
    resumable();
    if (hooks_.stop) result_.exit = hooks_.stop();
    if (result_.exit != RunExit::ok) {
      const char* why = result_.exit == RunExit::time_limit ? "stopped by the time limit" : "interrupted";
      result_.reason = scene_.rest ? fmt::format("{} after {} steps, {}", why, result_.relaxation.steps, unrest())
                                   : fmt::format("{} at t = {:.6g} s of {:.6g} s", why, result_.state.t, scene_.until);
    }
  }

  void relax_after(const StepReport& report) {
    Relaxation& relaxation = result_.relaxation;
    if (relax(result_.system->dynamic, work_, report, tolerance_, result_.state, relaxation)) {
      result_.energy.kinetic = 0;
      result_.loop.balance -= report.kinetic;
      result_.loop.trough = result_.loop.balance;
    }
    if (result_.state.t < pins_done_) restart(relaxation);
  }
  std::string unrest() const {
    const double left = result_.relaxation.remaining;
    return std::isfinite(left) ? fmt::format("a point would still move by {:.3g} m if released", left)
                               : "the cloth is still on its way";
  }
  void report_unrest() {
    result_.exit = RunExit::check_failed;
    result_.reason = fmt::format(
        "not at rest after {} steps: {}, allowed is {:.3g} m. Resume with a larger "
        "solver.rest.max_steps or solver.rest.tolerance",
        result_.relaxation.steps, unrest(), tolerance_);
  }

  // Less than what ends a run, but more than a stable one gains.
  void check_energy() {
    const EnergyBalance& e = result_.energy;
    const double turned = result_.loop.scale;
    if (!(e.injected > scene_.energy_gain * turned) || !(e.injected > result_.loop.rounding)) return;
    result_.exit = RunExit::check_failed;
    result_.reason = fmt::format(
        "the energy grew by {:.2g} % of the energy exchanged with no matching work, allowed are {:.2g} % "
        "(solver.energy_gain): a smaller dt or a lower strain_limit.stiffness is more accurate",
        100 * e.injected / turned, 100 * scene_.energy_gain);
  }

  // A start that breaks the limits is moved onto them, at rest: a step would turn the rest into a velocity of rest /
  // dt.
  void settle() {
    const System& system = *result_.system;
    if (!system.projection || system.projection->measure(result_.state.x, 0).converged) return;
    const ProjectionReport report = system.projection->project(result_.state.x, 0);
    result_.warnings.push_back(fmt::format("the start broke the strain limit or missed a pin; moved onto them{}",
                                           report.converged ? "" : " as far as they allow"));
    initialise(system.dynamic, result_.state);
  }

  // Why a step can't be accepted; empty where it can.
  std::string judge(const StepReport& report) {
    if (!report.finite) return "the numbers are no longer finite";
    const EnergyBalance& e = result_.energy;
    const double elastic = report.elastic.total() + report.limit_energy;
    const double now = report.kinetic + 0.5 * (e.elastic() + elastic);
    const double work =
        e.load_work + e.drag_work + e.motion_work + 0.5 * (report.load_work + report.drag_work + report.motion_work);
    const double balance = now - e.start - work;
    const double turned = std::max({result_.loop.scale, std::abs(e.load_work + report.load_work),
                                    std::abs(e.motion_work + report.motion_work), std::abs(e.drag_work), e.now()});
    const double smaller_step = report.dt < (1 - 1e-9) * result_.dt_last ? result_.loop.kick : 0;
    const bool careful =
        bounded() && !hard_limit() && result_.loop.dt_scale > smallest_careful && result_.steps >= first_steps;
    const double rise = balance - (careful ? result_.loop.trough : result_.loop.balance);
    if (rise > (careful ? small_rise : step_rise) * turned + smaller_step + result_.loop.rounding) {
      return fmt::format("energy grew by {:.3g} J with no matching work ({:.3g} J exchanged so far)", rise, turned);
    }
    // What the end of the step holds can't exceed the budget either.
    const double stored = report.kinetic_end + elastic - e.start - e.load_work - e.drag_work - e.motion_work -
                          report.load_work - report.drag_work - report.motion_work;
    if (std::max(balance, stored) > total_rise * turned + result_.loop.rounding) {
      return fmt::format("energy has grown by {:.3g} J with no matching work ({:.3g} J exchanged so far)",
                         std::max(balance, stored), turned);
    }
    result_.loop.scale = turned;
    result_.loop.kick = report.kick;
    // What a smaller step seems to gain is no rise.
    result_.loop.trough += std::clamp(balance - result_.loop.balance, 0.0, smaller_step);
    result_.loop.trough = careful ? std::min(result_.loop.trough, balance) : balance;
    result_.loop.balance = balance;
    return {};
  }

  void accept(const StepReport& report) {
    EnergyBalance& e = result_.energy;
    e.kinetic = report.kinetic;
    e.stored = report.elastic.energy;
    e.stored.set("limit", report.limit_energy);
    e.load_work += report.load_work;
    e.drag_work += report.drag_work;
    e.motion_work += report.motion_work;
    e.injected = std::max(e.injected, result_.loop.balance);
    result_.dt_min = result_.steps == 0 ? report.dt : std::min(result_.dt_min, report.dt);
    result_.dt_max = std::max(result_.dt_max, report.dt);
    result_.dt_last = report.dt;
    result_.last_projection = report.projection;
    result_.iterations_sum += report.projection.iterations;
    result_.iterations_max = std::max(result_.iterations_max, report.projection.iterations);
    if (!report.projection.converged) ++result_.unconverged_steps;
    if (!scene_.dt && report.projection.damped && result_.loop.dt_scale > smallest_damped) {
      result_.loop.dt_scale = std::max(smallest_damped, damped_scale * result_.loop.dt_scale);
    }
    // Larger again, but each time that this proved too early later.
    if (++result_.loop.calm >= result_.loop.patience) {
      result_.loop.calm = 0;
      result_.loop.dt_scale = std::min(1.0, 2 * result_.loop.dt_scale);
    }
    ++result_.steps;
    ++result_.loop.steps_since_bound;
    result_.loop.strain = report.elastic.strain;
    if (stiffer(result_.loop.strain, result_.loop.strain_at_bound, stiffening))
      result_.loop.steps_since_bound = result_.loop.bound_every;
  }

  void release(double t) {
    const bool any =
        std::ranges::any_of(scene_.pins, [&](const ScenePin& pin) { return pin.release && *pin.release == t; });
    if (!any) return;
    const Eigen::VectorXd q = control_points(*result_.system, result_.state);
    const Eigen::VectorXd v = control_point_velocity(*result_.system, result_.state);
    result_.system = assemble(build_, t, hooks_.workers);
    result_.loop.assembled = t;
    result_.state = state_from(*result_.system, q, v, t);
    // The released control points' kinetic energy joins the balance.
    double kinetic = 0;
    const MechanicalSystem& dynamic = result_.system->dynamic;
    for (Eigen::Index k = 0; k < dynamic.node_mass.size(); ++k) {
      kinetic += 0.5 * dynamic.node_mass[k] * result_.state.v.segment<3>(3 * k).squaredNorm();
    }
    result_.energy.start += kinetic - result_.energy.kinetic + limit_energy() - result_.energy.stored.of("limit");
    result_.energy.kinetic = kinetic;
    result_.energy.stored.set("limit", limit_energy());
    result_.last_projection.converged = true;
    evaluate_bound();
  }

  void emit_frame() {
    const Clock::time_point start = Clock::now();
    const int number = result_.frames++;
    result_.frame_times.push_back(result_.state.t);
    if (!hooks_.frame) return;
    const Eigen::VectorXd q = control_points(*result_.system, result_.state);
    const Eigen::VectorXd v = control_point_velocity(*result_.system, result_.state);
    hooks_.frame({number, result_.state.t, result_.dt_last, *result_.system, q, v});
    result_.frame_seconds += since(start);
  }

  std::string worst_place() const {
    const int row = result_.last_projection.worst_row;
    if (!result_.system->projection || row < 0) return "at a pin";
    const StrainRow& strain = result_.system->projection->rows().strain[static_cast<std::size_t>(row)];
    const BuiltPanel& panel = build_.panels[static_cast<std::size_t>(strain.panel)];
    return fmt::format("in {} at (u, v) = ({:.6g}, {:.6g}) of panel '{}'", strain.warp ? "warp" : "weft", strain.uv.x(),
                       strain.uv.y(), panel.name);
  }

  void fail(const std::string& what) {
    result_.exit = RunExit::solver_failed;
    std::string where;
    const System& system = *result_.system;
    const Eigen::VectorXd q = control_points(system, result_.state);
    if (q.allFinite()) {
      const TimeStepBound bound = bound_of(system);
      where = fmt::format("; the stiffest place is {} ({}), which needs steps below {:.3g} s",
                          describe_cell(build_, bound.cell), bound.bending ? "bending" : "membrane", bound.dt);
    }
    const ProjectionReport& p = result_.last_projection;
    if (p.strain_violation > scene_.strain_limit.tolerance)
      where += fmt::format("; the strain limit is broken by {:.3g} {}", p.strain_violation, worst_place());
    if (p.place_violation > 1e-6) where += fmt::format("; a pin is missed by {:.3g} m", p.place_violation);
    const StrainLimit& limit = scene_.strain_limit;
    std::string advice = hard_limit() ? "Use the default solver and variant, whose limit yields"
                         : scene_.dt  ? "Use dt = \"auto\" or a smaller dt"
                                      : "Use a smaller dt";
    if (limit.on) {
      for (std::size_t k = 0; limit.stiffness && k < build_.panels.size(); ++k) {
        if (*limit.stiffness > default_limit_stiffness(build_, static_cast<int>(k))) {
          advice += ", a lower strain_limit.stiffness";
          break;
        }
      }
      advice += limit.weft.slack == 0 ? ", a larger strain_limit.tolerance or regularisation" : ", wider limits";
    }
    result_.reason =
        fmt::format("at t = {:.6g} s {}{}. {}, or look for pins that contradict each other or pull too hard",
                    result_.state.t, what, where, advice);
  }

  void report_limit() {
    result_.exit = RunExit::check_failed;
    const ProjectionReport& p = result_.last_projection;
    result_.reason = fmt::format(
        "the strain limit is not met at the end: {:.3g} {}, allowed {:.3g}; pins off by {:.3g} m; {} of {} steps did "
        "not "
        "converge",
        p.strain_violation, worst_place(), scene_.strain_limit.tolerance, p.place_violation, result_.unconverged_steps,
        result_.steps);
  }

  const Build& build_;
  const Scene& scene_;
  const RunHooks& hooks_;
  std::unique_ptr<System> start_system_;  // null: begin() assembles it
  RunResult result_;
  const double tolerance_ = rest_tolerance(build_);
  const double pins_done_ = pins_done();
  StepWork work_;
  const Clock::time_point start_ = Clock::now();
};

}  // namespace

const char* name(RunExit exit) {
  switch (exit) {
    case RunExit::ok:
      return "ok";
    case RunExit::solver_failed:
      return "solver";
    case RunExit::check_failed:
      return "check";
    case RunExit::interrupted:
      return "interrupted";
    case RunExit::time_limit:
      return "time_limit";
  }
  return "";
}

double rest_tolerance(const Build& build) {
  if (!build.scene.rest) return 0;
  if (build.scene.rest->tolerance) return *build.scene.rest->tolerance;
  double largest = 0;
  for (const ClothPanel& panel : build.model->panels()) largest = std::max(largest, extent(panel));
  return rest_share * largest;
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

double planned_step(const Scene& scene, const TimeStepBound& bound) {
  return scene.dt ? *scene.dt : std::min(step_safety * bound.dt, scene.every);
}

std::string describe_cell(const Build& build, const Cell& cell) {
  const BuiltPanel& panel = build.panels[static_cast<std::size_t>(cell.panel)];
  const KnotMesh& mesh = panel.topology.mesh;
  const auto i = static_cast<std::size_t>(cell.i), j = static_cast<std::size_t>(cell.j);
  return fmt::format("panel '{}', cell ({}, {}), u in [{:.6g}, {:.6g}], v in [{:.6g}, {:.6g}]", panel.name, cell.i,
                     cell.j, mesh.u[i], mesh.u[i + 1], mesh.v[j], mesh.v[j + 1]);
}

void require_time_left(const Build& build, const RunState& state) {
  const Scene& scene = build.scene;
  if (state.state.t <= scene.until) return;
  throw InputError(fmt::format("{}: solver.until is {} s, but the run to be resumed is at {} s already",
                               scene.path.string(), scene.until, state.state.t));
}

double gravity_potential(const Build& build, const Eigen::VectorXd& q) {
  const Eigen::VectorXd moved = q - build.start;
  double potential = 0;
  for (int i = 0; i < build.model->point_count(); ++i) {
    potential -= build.model->lumped_mass()[i] * build.scene.gravity.dot(moved.segment<3>(3 * i));
  }
  return potential;
}

RunResult run(const Build& build, const RunHooks& hooks) {
  return Loop(build, RunResult(), hooks)();
}

RunResult run(const Build& build, std::unique_ptr<System> start, const RunHooks& hooks) {
  return Loop(build, std::move(start), hooks)();
}

RunResult run(const Build& build, RunResult from, const RunHooks& hooks) {
  return Loop(build, std::move(from), hooks)();
}

}  // namespace toile
