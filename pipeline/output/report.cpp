// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "pipeline/base/version.h"
#include "pipeline/output/output.h"

namespace toile {
namespace {

using Json = nlohmann::ordered_json;

Json array(const Eigen::Ref<const Eigen::VectorXd>& x) {
  Json result = Json::array();
  for (const double value : x) result.push_back(value);
  return result;
}

Json stress(const Extremes& e) {
  return {{"min_weft", e.min[0]}, {"max_weft", e.max[0]}, {"mean_weft", e.mean[0]},
          {"min_warp", e.min[1]}, {"max_warp", e.max[1]}, {"mean_warp", e.mean[1]}};
}

Json measured(double value, const char* unit) {
  return {{"value", value}, {"unit", unit}};
}

Json panel_json(const BuiltPanel& panel) {
  const NurbsSurface& s = panel.face.surface;
  const KnotMesh& mesh = panel.topology.mesh;
  const auto cells = [&](CellKind kind) { return std::ranges::count(panel.topology.cells, kind); };
  return {
      {"name", panel.name},
      {"degree", {s.u().degree(), s.v().degree()}},
      {"spans", {mesh.u.size() - 1, mesh.v.size() - 1}},
      {"control_points", {s.count_u(), s.count_v()}},
      {"cells",
       {{"inside", cells(CellKind::inside)}, {"cut", cells(CellKind::cut)}, {"outside", cells(CellKind::outside)}}}};
}

// What studies look at by name. A number that doesn't exist (nothing fell, so nothing can be compared with its work)
// is left out.
Json measures_json(const System& system, const RunResult& run, const StateMeasures& m) {
  Json measures = {{"area", measured(m.area, "m2")},
                   {"mass", measured(m.mass, "kg")},
                   {"lowest", measured(m.lowest, "m")},
                   {"highest", measured(m.highest, "m")},
                   {"largest_deflection", measured(m.largest_deflection, "m")},
                   {"strain_max", measured(m.strain.max.maxCoeff(), "1")},
                   {"strain_min", measured(m.strain.min.minCoeff(), "1")},
                   {"strain_p999", measured(m.strain.p999.maxCoeff(), "1")},
                   {"strain_mean_abs", measured(m.strain.mean_abs.mean(), "1")}};
  const double elastic = run.energy.elastic();
  if (system.strain_rows > 0 && elastic > 0) measures["hourglass_share"] = measured(m.unseen_energy / elastic, "1");
  const double fall = -run.energy.gravity;
  if (fall > 0) measures["injected_over_gravity_work"] = measured(run.energy.injected / fall, "1");
  for (std::size_t k = 0; k < m.points.size(); ++k) {
    measures["point_" + std::to_string(k)] = {{"value", array(m.points[k])}, {"unit", "m"}};
  }
  return measures;
}

}  // namespace

std::vector<std::pair<const char*, double>> energy_entries(const EnergyBalance& e) {
  std::vector<std::pair<const char*, double>> entries{{"kinetic", e.kinetic}};
  for (const EnergyParts::Part& part : e.stored) entries.emplace_back(part.name, part.value);
  entries.insert(entries.end(), {{"gravity", e.gravity},
                                 {"dissipated", e.dissipated()},
                                 {"dissipated_by_drag", 0 - e.drag_work},
                                 {"dissipated_by_steps", e.numerical()},
                                 {"loads_work", e.load_work},
                                 {"motion_work", e.motion_work},
                                 {"injected", e.injected}});
  return entries;
}

namespace {

ContactProjection::Counts contact_counts(const RunResult& run) {
  ContactProjection::Counts counts = run.former_contact;
  if (run.system->contact) counts += run.system->contact->counts();
  return counts;
}

Json seams_json(const Build& build, const RunResult& run, const StateMeasures& m) {
  if (build.seams.empty()) return {{"max_gap", nullptr}};
  Json list = Json::array();
  double widest = 0;
  for (std::size_t k = 0; k < build.seams.size(); ++k) {
    const BuiltSeam& seam = build.seams[k];
    const SceneSeam& named = build.scene.seams[k];
    widest = std::max(widest, m.seams[k].gap);
    const auto side = [](const SeamSide& s, double length) -> Json {
      return {{"panel", s.panel}, {"loop", s.loop}, {"curves", s.curves}, {"length", length}};
    };
    list.push_back({{"a", side(named.a, seam.length_a)},
                    {"b", side(named.b, seam.length_b)},
                    {"ratio", seam.length_a / seam.length_b},
                    {"gap", m.seams[k].gap},
                    {"closed", run.sewing.progress[k]},
                    {"force_per_length", {{"max", m.seams[k].force}, {"mean", m.seams[k].mean_force}}}});
  }
  return {{"max_gap", widest}, {"closed_at", run.sewn > 0 ? Json(run.sewn) : Json(nullptr)}, {"list", list}};
}

Json contact_json(const Build& build, const System& system, const RunResult& run, const StateMeasures& m) {
  if (!system.contact || !m.contact) return {{"max_penetration", nullptr}, {"min_distance", nullptr}};
  Json out = {{"max_penetration", m.contact->penetration},
              {"min_distance", nullptr},
              {"allowed", m.contact->allowed},
              {"contacts", run.last_projection.contacts},
              {"sampled_points", system.contact->proxy().vertices()}};
  if (std::isfinite(m.contact->distance)) out["min_distance"] = m.contact->distance;
  if (!m.contact->where.empty()) out["deepest"] = m.contact->where;
  out["obstacles"] = Json::array();
  for (std::size_t k = 0; k < build.obstacles.size(); ++k)
    out["obstacles"].push_back({{"name", build.obstacles[k]->name()}, {"force", array(m.contact->forces[k])}});
  return out;
}

}  // namespace

Json report_json(const Build& build, const RunResult& run, const StateMeasures& m, double write_seconds) {
  const Scene& scene = build.scene;
  const System& system = *run.system;
  Json report;
  report["scene"] = scene.name;
  report["version"] = version();
  report["exit"] = name(run.exit);
  if (run.exit != RunExit::ok) report["reason"] = run.reason;
  report["model"] = "shell";
  report["scheme"] = named_scheme(scene.scheme).name;
  report["panels"] = Json::array();
  for (const BuiltPanel& panel : build.panels) report["panels"].push_back(panel_json(panel));
  report["frames"] = run.frames;
  report["steps"] = run.steps;
  report["redone_steps"] = run.redone_steps;
  report["simulated_seconds"] = run.time;
  if (scene.rest) {
    const Relaxation& r = run.relaxation;
    report["rest"] = {
        {"steps", r.steps}, {"halts", r.halts}, {"trials", r.trials}, {"tolerance", rest_tolerance(build)}};
    // Left out where nothing can be said yet.
    if (std::isfinite(r.remaining)) report["rest"]["remaining"] = r.remaining;
    if (scene.rest->load_steps) {
      report["rest"]["load_factor"] = run.path.factor;
      report["rest"]["negative_eigenvalues"] = run.path.negative;
    }
  }
  const double computing = run.wall_seconds - run.frame_seconds;
  report["wall_seconds"] = computing;
  report["wall_seconds_per_frame"] = run.time > run.from ? computing / ((run.time - run.from) * 30) : 0.0;
  report["seconds"] = {{"read", build.read_seconds},
                       {"trim", build.trim_seconds},
                       {"force", run.force_seconds},
                       {"projection", run.projection_seconds - contact_counts(run).seconds()},
                       {"time_step", run.bound_seconds},
                       {"contact", contact_counts(run).seconds()},
                       {"write", run.frame_seconds + write_seconds}};
  report["dt"] = {{"min", run.dt_min}, {"max", run.dt_max}};
  std::size_t points = 0, used = 0;
  for (const auto& panel : system.points) {
    points += panel.size();
    used += static_cast<std::size_t>(std::ranges::count(panel, true, &ConstraintPoint::used));
  }
  report["degrees_of_freedom"] = 3 * system.map->nodes();
  report["control_points"] = build.model->point_count();
  report["constraint_points"] = points;
  report["constraint_points_used"] = scene.strain_limit.on ? used : 0;
  report["constraint_rows"] = {{"strain", system.strain_rows}, {"pins", system.place_components}};
  report["strain"] = {{"max_weft", m.strain.max[0]},
                      {"max_warp", m.strain.max[1]},
                      {"min_weft", m.strain.min[0]},
                      {"min_warp", m.strain.min[1]},
                      {"p999_weft", m.strain.p999[0]},
                      {"p999_warp", m.strain.p999[1]},
                      {"mean_abs_weft", m.strain.mean_abs[0]},
                      {"mean_abs_warp", m.strain.mean_abs[1]},
                      {"min_shear", m.shear.min},
                      {"max_shear", m.shear.max},
                      {"mean_abs_shear", m.shear.mean_abs},
                      {"at_constraints_max", m.at_constraints_max}};
  if (system.strain_rows > 0) {
    report["strain"]["at_constraints"] = {{"min_weft", m.at_constraints.min[0]},
                                          {"max_weft", m.at_constraints.max[0]},
                                          {"min_warp", m.at_constraints.min[1]},
                                          {"max_warp", m.at_constraints.max[1]}};
  }
  // One number, or what a band allows: [weft, warp] where the scene names a limit.
  const StrainLimit& limit = scene.strain_limit;
  if (limit.on && limit.weft.slack == 0) report["strain"]["limit"] = limit.tolerance;
  if (limit.on && limit.weft.slack > 0) {
    report["strain"]["limit"] = {{"compress", {limit.weft.compress, limit.warp.compress}},
                                 {"tolerance", limit.tolerance}};
    if (limit.stretched) report["strain"]["limit"]["stretch"] = {limit.weft.stretch, limit.warp.stretch};
  }
  report["points"] = Json::array();
  const std::vector<Eigen::Vector3d> starts = output_points(build, build.start);
  for (std::size_t k = 0; k < m.points.size(); ++k) {
    report["points"].push_back({{"panel", scene.points[k].panel},
                                {"uv", array(scene.points[k].uv)},
                                {"position", array(m.points[k])},
                                {"moved", array(m.points[k] - starts[k])}});
  }
  report["reactions"] = Json::array();
  for (std::size_t k = 0; k < m.reactions.size(); ++k) {
    report["reactions"].push_back(
        {{"pin", k}, {"panel", scene.pins[k].panel}, {"at", scene.pins[k].at.text}, {"force", array(m.reactions[k])}});
    if (m.gaps[k]) report["reactions"].back()["gap"] = *m.gaps[k];
  }
  report["stress"] = stress(m.nominal);
  report["stress"]["second_pk"] = stress(m.second_pk);
  if (system.strain_rows > 0) {
    report["stress"]["raw"] = stress(m.raw_nominal);
    report["stress"]["raw"]["second_pk"] = stress(m.raw_second_pk);
    if (const auto& part = system.unbalanced)
      report["stress"]["unbalanced"] = {{"weft", part->x()}, {"warp", part->y()}};
  }
  report["energy"] = Json::object();
  for (const auto& [what, joule] : energy_entries(run.energy)) report["energy"][what] = joule;
  report["projection"] = {{"iterations_mean", run.steps > 0 ? run.iterations_sum / run.steps : 0.0},
                          {"iterations_max", run.iterations_max},
                          {"gram_nonzeros", system.projection ? system.projection->gram_nonzeros() : 0},
                          {"unconverged_steps", run.unconverged_steps},
                          {"solver", name(scene.strain_limit.solver)}};
  if (scene.strain_limit.on && scene.strain_limit.solver == LimitSolver::substeps) {
    report["projection"]["percentile"] = scene.strain_limit.percentile;
    report["projection"]["percentile_held"] = 100 * run.last_projection.within;
    report["projection"]["worst_row"] = run.last_projection.strain_violation;
  }
  // Numbers of what doesn't exist in a run are null, not 0.
  report["contact"] = contact_json(build, system, run, m);
  report["seams"] = seams_json(build, run, m);
  Json stages = Json::array({"shell"});
  if (system.strain_rows + system.place_rows > 0) stages.push_back("projection");
  if (system.contact) stages.push_back("contact");
  report["stages"] = stages;
  // What each stage that ran took. `seconds` above counts the same seconds, of stages that didn't run too.
  Json counters = {{"shell", {{"seconds", run.force_seconds}, {"bytes", build.model->table_bytes()}}}};
  if (system.strain_rows + system.place_rows > 0) {
    counters["projection"] = {{"seconds", run.projection_seconds - contact_counts(run).seconds()},
                              {"bytes", sizeof(double) * system.projection->factor_nonzeros()}};
  }
  if (system.contact) {
    const ContactProjection::Counts counts = contact_counts(run);
    counters["contact"] = {
        {"seconds", counts.seconds()}, {"steps", counts.steps}, {"rounds", counts.rounds}, {"sweeps", counts.sweeps}};
  }
  counters["steps"] = {{"count", run.steps + run.redone_steps}};
  counters["time_step"] = {{"seconds", run.bound_seconds}};
  if (!scene.formats.empty()) counters["frames"] = {{"seconds", run.frame_seconds}};
  report["counters"] = counters;
  Json warnings = Json::array();
  for (const std::string& w : build.warnings) warnings.push_back(w);
  for (const std::string& w : run.warnings) warnings.push_back(w);
  report["warnings"] = warnings;
  report["measures"] = measures_json(system, run, m);
  return report;
}

}  // namespace toile
