// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/run/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/clock.h"
#include "geometry/error.h"
#include "pipeline/build/contact.h"
#include "pipeline/run/measures.h"

namespace toile {
namespace {

constexpr double rest_share = 1e-4;  // of the largest panel, of the tolerance of rest
// A step that the bound chooses is made smaller for a small rise of the energy, down to a share of the bound, unless
// the limit is hard, which leaves more in smaller ones. At first too little energy has been exchanged for a relative
// test.
constexpr double smallest_careful = 1.0 / 16;
constexpr int first_steps = 10;
constexpr double implicit_step = 1.0 / 60;  // s, where the scene names none
constexpr double closing_start = 0.1;       // of the speed of closing gaps: slower than that is little beside it
constexpr double pins_per_step = 0.1;       // of the longest span

}  // namespace

class Run::Impl {
 public:
  Impl(const Build& build, RunHooks hooks, RunResult from, std::unique_ptr<System> start)
      : build_(build),
        scene_(build.scene),
        hooks_(std::move(hooks)),
        start_system_(std::move(start)),
        result_(std::move(from)) {
    result_.from = result_.state.t;
    if (result_.system) require_time_left(build_, result_);
  }

  bool finished() const { return over_; }
  const RunResult& now() const { return result_; }

  void step() {
    if (over_) return;
    if (!begun_) start();
    const std::optional<double> target = schedule().next_target();
    if (!target) {
      over_ = true;
      return;
    }
    if (result_.state.t < *target && !ends_early()) advance(*target);
    if (result_.exit != RunExit::ok) {
      over_ = true;
    } else if (result_.state.t >= *target) {
      arrive(*target);
      over_ = !schedule().next_target();
    } else if (ends_early()) {
      end_early();
    }
  }

  RunResult finish() {
    over_ = true;
    if (!begun_) start();
    if (result_.exit == RunExit::ok && !result_.last_projection.converged) report_limit();
    if (result_.exit == RunExit::ok && scene_.rest && !at_rest()) report_unrest();
    if (result_.exit == RunExit::ok) check_seams();
    if (result_.exit == RunExit::ok) check_energy();
    result_.time = result_.state.t;
    result_.energy.gravity = gravity_potential(build_, control_points(*result_.system, result_.state));
    result_.wall_seconds = since(start_);
    return std::move(result_);
  }

 private:
  void start() {
    begun_ = true;
    if (result_.system) {
      // The forces of a run with another kind of end are others.
      if (result_.relaxing != scene_.rest.has_value()) initialise(result_.system->dynamic, result_.state);
    } else {
      begin();
      emit_frame();
      finish_target(0);
    }
    result_.relaxing = scene_.rest.has_value();
  }
  void arrive(double target) {
    release(target);
    if (target == schedule().next_frame()) emit_frame();
    finish_target(target);
  }
  // Ends before its time. A run that goes on from here has no frame now.
  void end_early() {
    result_.accepted = RunState(result_);
    if (result_.done < result_.state.t) emit_frame();
    result_.done = result_.state.t;
    over_ = true;
  }

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
    const Elastic elastic = internal_force(result_.system->dynamic.potentials, q, force, hooks_.workers);
    result_.energy.stored = elastic.energy;
    result_.energy.stored.set("limit", limit_energy());
    result_.energy.start = result_.energy.elastic();
    result_.watch.exchanged = result_.energy.start;
    result_.control.strain = elastic.strain;
    evaluate_bound();
    if (scene_.dt && !implicit()) hold_to_bound();
    result_.watch.rounding = rounding_energy(result_.system->dynamic, build_.start, result_.bound.dt);
    result_.sewing = *result_.system->sewing;
    if (!result_.sewing.done()) {
      // Gaps begin to close ever so slowly, where nothing else is at work.
      const double speed = closing_start * scene_.sewing.speed;
      result_.watch.rounding =
          std::max(result_.watch.rounding, 0.5 * result_.system->dynamic.node_mass.sum() * speed * speed);
    }
  }

  // Nets that don't follow the threads lock where rows are stiff. (analysis/constraint/README.md, "Which rows")
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
    result_.done = t;
    resumable();
  }

  Schedule schedule() const { return {scene_, result_.state.t, result_.done}; }

  bool at_rest() const { return scene_.rest && result_.relaxation.remaining <= tolerance_; }
  // Before its time: at rest, or at the end of the steps that it may take to get there.
  bool ends_early() const { return at_rest() || (scene_.rest && result_.relaxation.steps >= scene_.rest->max_steps); }
  // Implicit steps are stable at any size.
  bool implicit() const { return toile::implicit(scene_); }
  // Until rest by Newton's method: no motion, but ever larger steps against ever less inertia.
  bool equilibrating() const { return scene_.rest && scene_.rest->method == RestMethod::newton; }
  void evaluate_bound() {
    if (implicit()) return;
    StepControl& control = result_.control;
    const double before = result_.bound.dt;
    const int interval = control.bound_every;
    const bool in_turn = control.begin_bound(), held = bounded();
    if (!held && !control.stiffened()) return;
    control.strain_at_bound = control.strain;
    if (!held) return hold_to_bound();
    result_.bound = ask_for_bound();
    if (in_turn) control.settle_interval(interval, before, result_.bound.dt);
  }
  TimeStepBound ask_for_bound() {
    const Clock::time_point start = Clock::now();
    const TimeStepBound bound = bound_of(*result_.system);
    result_.bound_seconds += since(start);
    return bound;
  }

  bool hard_limit() const { return scene_.strain_limit.on && hard(scene_.strain_limit.solver); }
  bool by_percentile() const { return scene_.strain_limit.on && scene_.strain_limit.solver == LimitSolver::substeps; }
  // A step that the scene names is held to the bound once it has proved too large.
  bool bounded() const { return !implicit() && (!scene_.dt || result_.bound.dt > 0); }
  double largest_step() const {
    const double share = step_share(*result_.system), planned = planned_step(scene_, result_.bound, share);
    return scene_.dt && bounded() ? std::min(planned, share * result_.bound.dt) : planned;
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
                           system.dynamic.workers, system.springs.get());
  }
  double limit_energy() const {
    const System& system = *result_.system;
    return system.projection ? system.projection->energy(result_.state.x, result_.state.t) : 0;
  }
  void advance(double target) {
    if (result_.control.bound_is_due()) evaluate_bound();
    double largest = result_.control.scale * largest_step();
    if (!scene_.dt && !equilibrating()) largest *= result_.relaxation.dt_share;
    if (!scene_.dt && result_.state.t < motion_done_) largest = held_to_pins(largest);
    const double left = target - result_.state.t;
    // A remainder of rounding makes no step of its own.
    const double count = std::max(1.0, std::ceil(left / largest * (1 - 1e-9)));
    double dt = left / count;
    if (!(dt > 0) || result_.state.t + dt == result_.state.t) {
      result_.accepted = RunState(result_);
      fail(fmt::format("the step of {:.3g} s is too small to advance the time", dt));
      return;
    }
    if (result_.system->path) return follow_path(dt);
    for (bool halved = false;; halved = true) {
      const StepReport report = equilibrating() ? result_.system->implicit->equilibrate(
                                                      result_.state, dt, dt * result_.relaxation.dt_share, work_)
                                                : toile::step(*result_.system, result_.state, dt, work_);
      result_.force_seconds += report.force_seconds;
      result_.projection_seconds += report.projection_seconds;
      std::string trouble = unmet(report);
      const bool no_balance = !trouble.empty();
      if (trouble.empty()) trouble = why_refused(result_.watch, result_.energy, report, result_.dt_last, careful());
      if (trouble.empty()) {
        accept(report);
        if (!result_.sewing.done()) sew(report);
        if (scene_.rest) relax_after(report);
        // The last step of a stretch ends on the target itself, not on a rounded sum.
        if (count == 1 && !halved) result_.state.t = target;
        break;
      }
      if (report.finite) std::swap(result_.state, work_.other);
      if (!halved) result_.accepted = RunState(result_);
      if (!bounded() && !implicit()) hold_to_bound();
      ++result_.redone_steps;
      if (no_balance && !result_.sewing.done()) {
        hold_back(result_.sewing, scene_);
        set_sewing(*result_.system, build_, result_.sewing, result_.state.q);
      }
      result_.control.refuse(!halved, no_balance);
      result_.watch.trough = result_.watch.balance;
      if (equilibrating() && hold_back(result_.relaxation)) continue;
      if (equilibrating() || result_.control.exhausted()) {
        fail(fmt::format("{}, even with a step of {:.3g} s", trouble, dt));
        return;
      }
      dt = std::min(dt / 2, largest_step());
      result_.control.scale /= 2;
    }
    end_of_step(dt);
  }

  // To the next equilibrium under loads that grow.
  void follow_path(double dt) {
    const PathReport found = result_.system->path->step(result_.state, dt, result_.path, work_);
    result_.projection_seconds += found.step.projection_seconds;
    result_.redone_steps = result_.path.halvings;
    if (!found.trouble.empty()) {
      result_.accepted = RunState(result_);
      result_.exit = RunExit::solver_failed;
      const char* advice = result_.path.factor == 0
                               ? "Where cloth swings freely without loads leave load_steps out; else use more"
                           : scene_.rest->arc_length
                               ? "Use more solver.rest.load_steps"
                               : "Use more solver.rest.load_steps, or solver.rest.arc_length = true where the load "
                                 "passes a limit";
      result_.reason = fmt::format("no equilibrium {}. {}", found.trouble, advice);
      return;
    }
    accept(found.step);
    ++result_.relaxation.steps;
    if (result_.path.factor == 1) {
      result_.relaxation.remaining = result_.path.remaining;
      if (result_.path.negative > 0)
        result_.warnings.push_back(fmt::format(
            "the equilibrium is not stable: {} eigenvalues of its stiffness are negative", result_.path.negative));
    }
    end_of_step(dt);
  }
  void end_of_step(double dt) {
    if (hooks_.progress) hooks_.progress({result_.state.t, scene_.until, dt, result_.steps, result_.frames});
    result_.accepted.reset();
    resumable();
    if (hooks_.stop) result_.exit = hooks_.stop();
    if (result_.exit == RunExit::ok) return;
    const char* why = result_.exit == RunExit::time_limit ? "stopped by the time limit" : "interrupted";
    result_.reason = scene_.rest ? fmt::format("{} after {} steps, {}", why, result_.relaxation.steps, unrest())
                                 : fmt::format("{} at t = {:.6g} s of {:.6g} s", why, result_.state.t, scene_.until);
  }

  // A limit with a law has a balance at every step that is small enough; hard rows that depend on each other may not.
  std::string unmet(const StepReport& report) const {
    const ProjectionReport& p = report.projection;
    if (!p.contact_met) {
      const ContactRow* row = result_.system->contact->worst();
      return fmt::format("the contacts find no balance{}{}", row ? ", least of all between " : "",
                         row ? describe_contact(build_, result_.system->contact->proxy(), *row) : "");
    }
    if (p.converged || hard_limit() || by_percentile() || (!scene_.strain_limit.on && !implicit())) return {};
    return fmt::format("{} no balance in {} iterations (strain {:.3g}, pins off by {:.3g} m)",
                       implicit() ? "the step finds" : "the strain limit and the pins find", p.iterations,
                       p.strain_violation, p.place_violation);
  }

  // Once the seams are closed, or can't be, gravity and friction come.
  void sew(const StepReport& report) {
    System& system = *result_.system;
    const DynamicState& state = result_.state;
    std::vector<double> force;
    for (const SeamMeasures& seam : seam_forces(build_, system, state, report.dt)) force.push_back(seam.force);
    const bool over = go_on(result_.sewing, scene_, build_.seams, force, state.t, report.dt);
    const double tightened = set_sewing(system, build_, result_.sewing, state.q);
    if (system.springs) {
      // The springs' ends are moved from outside, as pins are.
      result_.energy.stored.set(SeamSprings::name, system.springs->energy(state.q));
      result_.energy.motion_work += tightened;
      initialise(system.dynamic, result_.state);
    }
    if (!over) return;
    if (system.springs)
      begin_rows(result_.sewing, scene_, build_.seams, state.q, state.t);
    else
      result_.sewn = state.t;
    assemble_anew();
    // Steps that were too large for one stage say nothing of the next.
    result_.control.scale = 1;
    result_.control.patience = StepControl().patience;
    // Edges that are pulled together are no motion to be accurate in: the account begins with the sewn cloth.
    result_.energy.start += result_.watch.balance;
    result_.energy.injected = result_.watch.balance = result_.watch.trough = 0;
  }

  // Pins that would go far within a step would tear at the cloth beside them before the rest of it moves.
  double held_to_pins(double dt) {
    const double way = pins_move(*result_.system, result_.state.t, dt, pins_now_, pins_then_),
                 allowed = pins_per_step * span_;
    return way > allowed ? dt * allowed / way : dt;
  }

  void relax_after(const StepReport& report) {
    Relaxation& relaxation = result_.relaxation;
    if (equilibrating()) {
      approach(result_.system->dynamic, work_, result_.state, relaxation);
    } else if (relax(result_.system->dynamic, work_, report, tolerance_, result_.state, relaxation)) {
      result_.energy.kinetic = 0;
      result_.watch.balance -= report.at_end ? report.kinetic_end : report.kinetic;
      result_.watch.trough = result_.watch.balance;
    }
    if (result_.state.t < motion_done_ || !result_.sewing.done()) restart(relaxation);
  }
  std::string unrest() const {
    if (result_.system->path && result_.path.factor != 1)
      return fmt::format("{:.4g} of the loads are on", result_.path.factor);
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

  void check_seams() {
    for (std::size_t k = 0; k < build_.seams.size(); ++k) {
      const double progress = result_.sewing.progress[k];
      if (progress >= 1) continue;
      const SceneSeam& seam = scene_.seams[k];
      result_.exit = RunExit::check_failed;
      result_.reason =
          fmt::format("{}: seam {}, of panel '{}' to panel '{}', is still open by {:.3g} mm{}", seam.where, k,
                      seam.a.panel, seam.b.panel, 1e3 * open_part(progress) * build_.seams[k].gap,
                      result_.sewing.done()
                          ? fmt::format(" where it carries its {:.3g} N/m (sewing.force): the garment is too small "
                                        "there for what it goes around, or is held apart",
                                        scene_.sewing.force)
                          : "; a later solver.until gives it the time to close");
      return;
    }
  }

  // Less than what ends a run, but more than a stable one gains.
  void check_energy() {
    if (result_.system->path) return;  // no motion
    const EnergyBalance& e = result_.energy;
    const double exchanged = result_.watch.exchanged;
    if (!(e.injected > scene_.energy_gain * exchanged) || !(e.injected > result_.watch.rounding)) return;
    result_.exit = RunExit::check_failed;
    result_.reason = fmt::format(
        "the energy grew by {:.2g} % of the energy exchanged with no matching work, {:.2g} % is allowed "
        "(solver.energy_gain): a smaller dt or a lower strain_limit.stiffness is more accurate",
        100 * e.injected / exchanged, 100 * scene_.energy_gain);
  }

  // A start that breaks the limits is moved onto them, at rest: a step would turn what is left into a velocity of
  // violation / dt.
  void settle() {
    const System& system = *result_.system;
    if (!system.projection || system.projection->measure(result_.state.x, 0).converged) return;
    const ProjectionReport report = system.projection->project(result_.state.x, 0);
    result_.warnings.push_back(fmt::format("the start broke the strain limit or missed a pin; moved onto them{}",
                                           report.converged ? "" : " as far as they allow"));
    initialise(system.dynamic, result_.state);
  }

  // Steps that the bound chooses are refused for less, if a smaller one would be better.
  bool careful() const {
    return bounded() && !hard_limit() && result_.control.scale > smallest_careful && result_.steps >= first_steps &&
           result_.sewing.done();
  }

  void accept(const StepReport& report) {
    add_step(result_.energy, report, result_.watch);
    result_.dt_min = result_.steps == 0 ? report.dt : std::min(result_.dt_min, report.dt);
    result_.dt_max = std::max(result_.dt_max, report.dt);
    result_.dt_last = report.dt;
    result_.last_projection = report.projection;
    result_.iterations_sum += report.projection.iterations;
    result_.iterations_max = std::max(result_.iterations_max, report.projection.iterations);
    if (!report.projection.converged) ++result_.unconverged_steps;
    result_.control.accept(report.elastic.strain, !scene_.dt && report.projection.damped);
    ++result_.steps;
  }

  void release(double t) {
    const bool any =
        std::ranges::any_of(scene_.pins, [&](const ScenePin& pin) { return pin.release && *pin.release == t; });
    if (any) assemble_anew();
  }

  // The state goes on under what holds from now on.
  void assemble_anew() {
    const double t = result_.state.t;
    const Eigen::VectorXd q = control_points(*result_.system, result_.state);
    const Eigen::VectorXd v = control_point_velocity(*result_.system, result_.state);
    if (result_.system->contact) result_.former_contact += result_.system->contact->counts();
    result_.system = assemble(build_, t, hooks_.workers, &result_.sewing);
    result_.assembled = t;
    result_.state = state_from(*result_.system, q, v, t);
    // The released control points' kinetic energy joins the balance.
    double kinetic = 0;
    const MechanicalSystem& dynamic = result_.system->dynamic;
    for (Eigen::Index k = 0; k < dynamic.node_mass.size(); ++k) {
      kinetic += 0.5 * dynamic.node_mass[k] * result_.state.v.segment<3>(3 * k).squaredNorm();
    }
    result_.energy.start += kinetic - result_.energy.kinetic + limit_energy() - result_.energy.stored.of("limit");
    if (!result_.system->springs && result_.energy.stored.of(SeamSprings::name) != 0) {
      result_.energy.start -= result_.energy.stored.of(SeamSprings::name);
      result_.energy.stored.set(SeamSprings::name, 0);
    }
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
    if (by_percentile() && p.place_violation <= 1e-6) {
      result_.reason = fmt::format(
          "{:.4g} % of the rows are within the strain limit at the end, strain_limit.percentile asks for {:.4g} %; the "
          "worst has {:.3g} {}. A higher strain_limit.stiffness holds more, solver = \"projection\" holds all",
          100 * p.within, scene_.strain_limit.percentile, p.strain_violation, worst_place());
      return;
    }
    result_.reason = fmt::format(
        "the strain limit is not met at the end: {:.3g} {}, allowed {:.3g}; pins off by {:.3g} m; {} of {} steps did "
        "not "
        "converge",
        p.strain_violation, worst_place(), scene_.strain_limit.tolerance, p.place_violation, result_.unconverged_steps,
        result_.steps);
  }

  const Build& build_;
  const Scene& scene_;
  const RunHooks hooks_;
  std::unique_ptr<System> start_system_;  // null: begin() assembles it
  RunResult result_;
  const double tolerance_ = rest_tolerance(build_);
  const double motion_done_ = motion_done(scene_);
  const double span_ = longest_span(build_);
  bool begun_ = false, over_ = false;
  StepWork work_;
  Eigen::Matrix3Xd pins_now_, pins_then_;
  const Clock::time_point start_ = Clock::now();
};

Run::Run(const Build& build, RunHooks hooks, std::unique_ptr<System> start)
    : impl_(std::make_unique<Impl>(build, std::move(hooks), RunResult(), std::move(start))) {}
Run::Run(const Build& build, RunHooks hooks, RunResult from)
    : impl_(std::make_unique<Impl>(build, std::move(hooks), std::move(from), nullptr)) {}
Run::~Run() = default;

bool Run::finished() const {
  return impl_->finished();
}
void Run::step() {
  impl_->step();
}
const RunResult& Run::now() const {
  return impl_->now();
}
RunResult Run::finish() {
  return impl_->finish();
}

namespace {

RunResult to_the_end(Run& run) {
  while (!run.finished()) run.step();
  return run.finish();
}

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

double step_share(const System& system) {
  return system.projection ? std::min(step_safety, system.projection->step_share()) : step_safety;
}
double planned_step(const Scene& scene, const TimeStepBound& bound, double share) {
  if (scene.dt) return *scene.dt;
  return std::min(implicit(scene) ? implicit_step : share * bound.dt, scene.every);
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
  Run whole(build, hooks);
  return to_the_end(whole);
}

RunResult run(const Build& build, std::unique_ptr<System> start, const RunHooks& hooks) {
  Run whole(build, hooks, std::move(start));
  return to_the_end(whole);
}

RunResult run(const Build& build, RunResult from, const RunHooks& hooks) {
  Run whole(build, hooks, std::move(from));
  return to_the_end(whole);
}

}  // namespace toile
