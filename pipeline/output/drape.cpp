// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/output/drape.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "analysis/parallel/workers.h"
#include "geometry/clock.h"
#include "geometry/error.h"
#include "io/file.h"
#include "pipeline/base/exit_code.h"
#include "pipeline/base/interrupt.h"
#include "pipeline/base/json_text.h"
#include "pipeline/base/version.h"
#include "pipeline/build/build.h"
#include "pipeline/build/obstacles.h"
#include "pipeline/output/history.h"
#include "pipeline/output/output.h"
#include "pipeline/output/summary.h"
#include "pipeline/run/checkpoint.h"
#include "pipeline/run/run.h"

namespace toile {
namespace {

// Of wall time between checkpoints; the promise is two seconds.
constexpr double checkpoint_seconds = 1;

int exit_code(RunExit exit) {
  switch (exit) {
    case RunExit::ok:
      return exit_ok;
    case RunExit::solver_failed:
      return exit_solver;
    case RunExit::check_failed:
      return exit_check;
    case RunExit::interrupted:
      return exit_interrupted;
    case RunExit::time_limit:
      return exit_time_limit;
  }
  return exit_internal;
}

std::string describe(const Build& build, std::size_t k) {
  const BuiltPanel& panel = build.panels[k];
  const NurbsSurface& s = panel.face.surface;
  const auto cells = [&](CellKind kind) { return std::ranges::count(panel.topology.cells, kind); };
  return fmt::format(
      "panel '{}': degree {} x {}, {} x {} control points, {} whole and {} cut cells, {} constraint points, "
      "{} control points extended",
      panel.name, s.u().degree(), s.v().degree(), s.count_u(), s.count_v(), cells(CellKind::inside),
      cells(CellKind::cut), panel.points.size(), panel.extended.size());
}

// Reasons of constraint points that the projection leaves out, with their number.
std::map<std::string, int> unused(const System& system) {
  std::map<std::string, int> reasons;
  for (const auto& panel : system.points) {
    for (const ConstraintPoint& point : panel) {
      if (!point.used) ++reasons[point.why];
    }
  }
  return reasons;
}

// "42 s", "3 min", "2.5 h".
std::string duration(double seconds) {
  if (seconds < 100) return fmt::format("{:.0f} s", seconds);
  if (seconds < 6000) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

bool holds(const std::filesystem::path& directory, const std::filesystem::path& file) {
  std::error_code error;
  return std::filesystem::equivalent(directory, std::filesystem::absolute(file).parent_path(), error);
}

}  // namespace

namespace {

// What a drape writes into its folder while it runs, and at its end.
class Folder {
 public:
  // Nothing is written before this; `from`: the state that a resumed run goes on from.
  Folder(const Build& built, std::filesystem::path directory, const DrapeOptions& options, const RunState& from,
         Clock::time_point called)
      : built_(built), directory_(std::move(directory)), called_(called), start_time_(from.state.t) {
    const bool goes_on = options.resume && holds(directory_, *options.resume);
    if (!goes_on) prepare_directory(directory_, options.overwrite);
    log_.open(directory_ / "run.log", goes_on ? std::ios::app : std::ios::trunc);
    begin_log(options);
    writer_.emplace(built, directory_, from.frame_times);
    const std::filesystem::path former =
        options.resume ? std::filesystem::absolute(*options.resume).parent_path() / "history.csv" : "";
    history_.emplace(built, directory_ / "history.csv", former, from);
    start_ = saved_ = Clock::now();
  }

  void frame(const RunFrame& frame) {
    writer_->write(frame);
    log_ << fmt::format("frame {:4}  t = {:.6f} s  {:.2f} s of wall time\n", frame.number, frame.time, since(start_))
         << std::flush;
  }
  void resumable(const RunResult& now) {
    history_->add(now);
    if (now.steps == 0 || since(saved_) >= checkpoint_seconds) save(now, *now.system);
  }
  void save(const RunState& state, const System& system) {
    write_file(directory_ / "checkpoint", format_checkpoint(mark_, state, system));
    saved_ = Clock::now();
  }
  std::string progress(const RunProgress& p) const {
    if (built_.scene.rest) return fmt::format("until rest: t = {:.3f} s  step {} of {:.2g} s", p.time, p.steps, p.dt);
    const double gone = p.time - start_time_;
    return fmt::format("{:3.0f} %  t = {:.3f} of {:.3g} s  step {} of {:.2g} s  {} left", 100 * p.time / p.until,
                       p.time, p.until, p.steps, p.dt, duration(since(start_) * (p.until - p.time) / gone));
  }

  // Checkpoint, draped.igs and preview of the last state.
  void write_end(RunResult& result) {
    save(result.accepted ? *result.accepted : result, *result.system);
    writing_ = Clock::now();
    const Eigen::VectorXd q = control_points(*result.system, result.state);
    write_file(directory_ / "draped.igs", draped_file(built_, q).text);
    if (!built_.scene.preview) return;
    // A picture is a courtesy: its failure doesn't spoil the run.
    try {
      const std::string png = writer_->preview(*result.system, q);
      if (!png.empty()) write_file(directory_ / "preview.png", png);
    } catch (const Error& error) {
      result.warnings.push_back(fmt::format("preview.png was not drawn: {}", error.what()));
    }
  }
  // Returns the text of report.json.
  std::string write_report(const RunResult& result, const StateMeasures& measures) {
    const std::string report = json_text(report_json(built_, result, measures, since(writing_))) + "\n";
    write_file(directory_ / "report.json", report);
    log_ << fmt::format("{}: {} steps, {} redone, dt {:.3g} to {:.3g} s, {:.3f} s of wall time, files included\n",
                        name(result.exit), result.steps, result.redone_steps, result.dt_min, result.dt_max,
                        since(called_));
    if (!result.reason.empty()) log_ << result.reason << "\n";
    if (!log_.flush()) throw OutputError((directory_ / "run.log").string() + ": not everything could be written");
    return report;
  }

 private:
  void begin_log(const DrapeOptions& options) {
    log_ << "toile " << version() << "\nscene " << built_.scene.path.string() << "\n";
    if (options.resume) log_ << fmt::format("resumed from {} at t = {:.6f} s\n", options.resume->string(), start_time_);
    for (std::size_t k = 0; k < built_.panels.size(); ++k) log_ << describe(built_, k) << "\n";
    const bool twist_free =
        std::ranges::all_of(built_.scene.panels, [](const ScenePanel& p) { return p.fabric.bending.twist == 0; });
    if (twist_free) log_ << "twist stiffness is 0, as in the paper's bending law\n";
    for (const std::string& warning : built_.warnings) log_ << "warning: " << warning << "\n";
    for (const std::string& note : built_.notes) log_ << note << "\n";
  }

  const Build& built_;
  const std::filesystem::path directory_;
  const Clock::time_point called_;
  const double start_time_;
  const SceneMark mark_ = scene_mark(built_);
  std::ofstream log_;
  std::optional<FrameWriter> writer_;
  std::optional<History> history_;
  Clock::time_point start_, saved_, writing_;
};

void tell(const Build& built, Console& console) {
  for (const std::string& warning : built.warnings) console.warning(warning);
  for (const std::string& note : built.notes) console.detail(note);
  for (const std::string& note : built.scene.notes) console.note(note);
  for (std::size_t k = 0; k < built.panels.size(); ++k) console.detail(describe(built, k));
}

// What the end of a run shows that its steps could not.
void warn_of_end(const Build& built, RunResult& result, const StateMeasures& measures) {
  if (result.unconverged_steps > 0) {
    result.warnings.push_back(
        fmt::format("{} of {} steps did not meet the strain limit or the pins within {} iterations",
                    result.unconverged_steps, result.steps, built.scene.strain_limit.max_iterations));
  }
  constexpr double wide_gap = 5e-4;  // m
  for (std::size_t k = 0; k < measures.gaps.size(); ++k) {
    if (measures.gaps[k].value_or(0) <= wide_gap) continue;
    const ScenePin& pin = built.scene.pins[k];
    result.warnings.push_back(fmt::format(
        "{}: pin {} ({}): between the points held the cloth is up to {:.2g} mm off the curve; smaller cells "
        "(refine) hold it nearer",
        pin.where, k, pin.at.text, 1000 * *measures.gaps[k]));
  }
  if (measures.contact && measures.contact->penetration > measures.contact->allowed && result.exit == RunExit::ok) {
    result.exit = RunExit::check_failed;
    result.reason = fmt::format(
        "the cloth is {:.2g} mm nearer than its thickness and the obstacle's skin allow ({:.2g} mm allowed), deepest "
        "at "
        "{}. A smaller contact.spacing or contact.chord, or smaller cells (refine), keep it farther off",
        1e3 * measures.contact->penetration, 1e3 * measures.contact->allowed, measures.contact->where);
  }
  const BetweenPoints between = strained_between_points(built, measures);
  if (between.failed && result.exit == RunExit::ok) {
    result.exit = RunExit::check_failed;
    result.reason = between.text;
  } else if (!between.text.empty()) {
    result.warnings.push_back(between.text);
  }
}

}  // namespace

int drape(Scene scene, const DrapeOptions& options, Console& console) {
  const Clock::time_point called = Clock::now();
  const std::filesystem::path directory = options.directory.value_or(std::filesystem::path("out") / scene.name);
  const Build built = build(std::move(scene));
  std::optional<Workers> threads;
  if (options.threads > 1) threads.emplace(options.threads);
  RunHooks hooks;
  hooks.workers = threads ? &*threads : nullptr;
  tell(built, console);
  // What can be refused is refused before anything is written.
  RunResult result;
  std::unique_ptr<System> start;
  if (options.resume) {
    result = read_checkpoint(*options.resume, built, hooks.workers);
    require_time_left(built, result);
  } else {
    start = assemble(built, 0, hooks.workers);
  }

  Folder folder(built, directory, options, result, called);
  const InterruptGuard guard;
  hooks.stop = [&] {
    if (guard.asked()) return RunExit::interrupted;
    const auto& limit = built.scene.time_limit;
    return limit && since(called) >= *limit ? RunExit::time_limit : RunExit::ok;
  };
  hooks.resumable = [&](const RunResult& now) { folder.resumable(now); };
  hooks.frame = [&](const RunFrame& frame) { folder.frame(frame); };
  hooks.progress = [&](const RunProgress& progress) { console.live(folder.progress(progress)); };
  result = result.system ? run(built, std::move(result), hooks) : run(built, std::move(start), hooks);
  console.end_live();

  folder.write_end(result);
  // The forces of a refused step are not those of the state that it started from.
  const double forces_of = result.exit == RunExit::solver_failed ? 0 : result.dt_last;
  const StateMeasures measures = measure(built, *result.system, result.state, forces_of);
  warn_of_end(built, result, measures);
  for (const std::string& warning : result.warnings) console.warning(warning);
  const std::string report = folder.write_report(result, measures);

  for (const std::string& line : summary(built, result, measures, since(called))) console.note(line);
  console.note(fmt::format("wrote {}; open", directory.string()));
  for (const std::string& line : results_to_open(directory, built.scene.name)) console.note(line);
  if (options.json) std::fputs(report.c_str(), stdout);
  if (result.exit == RunExit::ok) return exit_ok;
  console.error(result.reason);
  const bool stopped = result.exit == RunExit::interrupted || result.exit == RunExit::time_limit;
  if (stopped && !options.command.empty()) {
    console.note("to go on from here:\n  " + resume_command(options.command, directory));
  }
  return exit_code(result.exit);
}

int dry_run(Scene scene, bool json, Console& console) {
  const Build built = build(std::move(scene));
  for (const std::string& warning : built.warnings) console.warning(warning);
  for (const std::string& note : built.scene.notes) console.note(note);
  std::unique_ptr<System> system = assemble(built, 0);
  TimeStepBound bound = time_step_bound(*built.model, *system->map, system->dynamic.node_mass, built.start);
  const double dt = planned_step(built.scene, bound, step_share(*system));
  long long steps = 0;
  std::vector<double> times;  // unknown for a run until rest
  if (!built.scene.rest) times = frame_times(built.scene);
  for (std::size_t k = 1; k < times.size(); ++k) {
    steps += static_cast<long long>(std::ceil((times[k] - times[k - 1]) / dt * (1 - 1e-9)));
  }
  // A few steps, timed, on a copy of the start.
  DynamicState state = state_from(*system, built.start, Eigen::VectorXd::Zero(built.start.size()), 0);
  const int trial = built.scene.rest ? 5 : static_cast<int>(std::min(5LL, steps));
  const Clock::time_point start = Clock::now();
  StepWork work;
  for (int k = 0; k < trial; ++k) step(*system, state, dt, work);
  const double per_step = trial > 0 ? since(start) / trial : 0;
  const std::size_t factor = system->projection ? system->projection->factor_nonzeros() : 0;
  const double bytes =
      static_cast<double>(built.model->table_bytes() + 8 * factor) + 8.0 * 30 * static_cast<double>(built.start.size());
  const std::map<std::string, int> reasons = unused(*system);
  if (json) {
    nlohmann::ordered_json out;
    out["scene"] = built.scene.name;
    out["dt"] = dt;
    out["dt_bound"] = bound.dt;
    out["limited_by"] = {{"panel", built.panels[static_cast<std::size_t>(bound.cell.panel)].name},
                         {"cell", {bound.cell.i, bound.cell.j}},
                         {"stiffness", bound.bending ? "bending" : "membrane"}};
    if (!built.scene.rest) {
      out["steps"] = steps;
      out["frames"] = times.size();
      out["estimated_seconds"] = per_step * static_cast<double>(steps);
    }
    out["seconds_per_step"] = per_step;
    out["estimated_bytes"] = bytes;
    out["control_points"] = built.model->point_count();
    out["degrees_of_freedom"] = 3 * system->map->nodes();
    out["strain_rows"] = system->strain_rows;
    out["pin_rows"] = system->place_components;
    out["unused_points"] = reasons;
    out["warnings"] = built.warnings;
    fmt::print("{}\n", json_text(out));
    return exit_ok;
  }
  fmt::print("step       {:.4g} s{}\n", dt, built.scene.dt ? " (as the scene says)" : "");
  fmt::print("limited by {} in {}: stable below {:.4g} s\n", bound.bending ? "bending" : "membrane stiffness",
             describe_cell(built, bound.cell), bound.dt);
  if (built.scene.rest) {
    fmt::print("steps      until no point would move by more than {:.3g} m if released, {} at most\n",
               rest_tolerance(built), built.scene.rest->max_steps);
    fmt::print("time       about {:.2g} s a step, without frames\n", per_step);
  } else {
    fmt::print("steps      {} for {} frames up to {} s\n", steps, times.size(), built.scene.until);
    fmt::print("time       about {:.2g} s, without frames\n", per_step * static_cast<double>(steps));
  }
  fmt::print("memory     about {:.2g} MB\n", bytes / 1e6);
  fmt::print("unknowns   {} of {} control points\n", 3 * system->map->nodes(), built.model->point_count());
  fmt::print("rows       {} of strain, {} of pins\n", system->strain_rows, system->place_components);
  for (const auto& [why, count] : reasons) fmt::print("unused     {} constraint points: {}\n", count, why);
  return exit_ok;
}

namespace {

struct SceneCheck {
  std::string scene, path;
  std::vector<std::string> panels, obstacles;  // each in a line
  nlohmann::ordered_json panel_table = nlohmann::ordered_json::array();
  std::vector<std::string> errors, warnings, notes, details;
  ExitCode code = exit_ok;
};

void add(std::vector<std::string>& all, const std::vector<std::string>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

void check_built(const Build& built, SceneCheck& out) {
  add(out.warnings, built.warnings);
  add(out.details, built.notes);
  for (std::size_t k = 0; k < built.panels.size(); ++k) {
    const BuiltPanel& panel = built.panels[k];
    out.panels.push_back(describe(built, k));
    out.panel_table.push_back({{"name", panel.name},
                               {"control_points", {panel.face.surface.count_u(), panel.face.surface.count_v()}},
                               {"constraint_points", panel.points.size()}});
  }
  add(out.warnings, assemble(built, 0)->warnings);
}

// Goes on as far as it can: a fault of an obstacle hides none of a panel.
SceneCheck check(const std::function<Scene()>& read) {
  SceneCheck out;
  const auto fail = [&](const std::string& why, ExitCode code) {
    out.errors.push_back(why);
    if (out.code == exit_ok) out.code = code;
  };
  try {
    Scene scene = read();
    out.scene = scene.name;
    out.path = scene.path.string();
    out.notes = scene.notes;
    BuiltObstacles obstacles = build_obstacles(scene);
    out.obstacles = obstacles.about;
    add(out.warnings, obstacles.warnings);
    add(out.notes, obstacles.notes);
    for (const std::string& fault : obstacles.faults) fail(fault, exit_input);
    if (!obstacles.faults.empty()) {
      scene.obstacles.clear();
      obstacles.obstacles.clear();
    }
    check_built(build(std::move(scene), std::move(obstacles.obstacles)), out);
  } catch (const InputError& error) {
    fail(error.what(), exit_input);
  } catch (const GeometryError& error) {
    fail(error.what(), exit_geometry);
  }
  return out;
}

}  // namespace

int check_scene(const std::function<Scene()>& read, bool json, Console& console) {
  const SceneCheck found = check(read);
  if (json) {
    nlohmann::ordered_json out;
    out["scene"] = found.scene;
    out["valid"] = found.errors.empty();
    out["panels"] = found.panel_table;
    out["obstacles"] = found.obstacles;
    out["errors"] = found.errors;
    out["warnings"] = found.warnings;
    std::vector<std::string> notes = found.notes;
    add(notes, found.details);
    out["notes"] = notes;
    fmt::print("{}\n", json_text(out));
    return found.code;
  }
  // What isn't valid gives nothing to work with.
  std::FILE* out = found.errors.empty() ? stdout : stderr;
  for (const auto* lines : {&found.obstacles, &found.panels})
    for (const std::string& line : *lines) fmt::print(out, "{}\n", line);
  for (const std::string& note : found.notes) console.note(note);
  for (const std::string& note : found.details) console.detail(note);
  for (const std::string& warning : found.warnings) console.warning(warning);
  for (const std::string& error : found.errors) console.error(error);
  if (found.errors.empty()) fmt::print("{}: valid\n", found.path);
  return found.code;
}

}  // namespace toile
