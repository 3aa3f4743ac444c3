// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/inspect.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <exception>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <thread>

#include "analysis/extension.h"
#include "analysis/projection/point_rule.h"
#include "analysis/projection/select_rows.h"
#include "analysis/workers.h"
#include "geometry/error.h"
#include "geometry/measure.h"
#include "pipeline/build.h"
#include "pipeline/json_text.h"
#include "pipeline/places.h"

namespace toile {
namespace {

// Largest distance in the parameter plane between the end of one curve and the start of the next.
double gap(const TrimLoop& loop) {
  double largest = 0;
  for (std::size_t k = 0; k < loop.curves.size(); ++k) {
    const TrimCurve& a = loop.curves[k];
    const TrimCurve& b = loop.curves[(k + 1) % loop.curves.size()];
    const Eigen::Vector2d end = a.reversed ? a.curve.start() : a.curve.end();
    const Eigen::Vector2d start = b.reversed ? b.curve.end() : b.curve.start();
    largest = std::max(largest, (end - start).norm());
  }
  return largest;
}

// How many control points have material under the spans of their function.
int active_control_points(const NurbsSurface& surface, const TrimTopology& topology) {
  std::vector<bool> active(static_cast<std::size_t>(surface.points().cols()), false);
  const KnotMesh& mesh = topology.mesh;
  for (int j = 0; j < mesh.cells_v(); ++j) {
    for (int i = 0; i < mesh.cells_u(); ++i) {
      if (topology.cells[static_cast<std::size_t>(mesh.cell(i, j))] == CellKind::outside) continue;
      const int su = surface.u().find_span(mesh.u[static_cast<std::size_t>(i)]);
      const int sv = surface.v().find_span(mesh.v[static_cast<std::size_t>(j)]);
      for (int b = sv - surface.v().degree(); b <= sv; ++b) {
        for (int a = su - surface.u().degree(); a <= su; ++a) {
          active[static_cast<std::size_t>(surface.index(a, b))] = true;
        }
      }
    }
  }
  return static_cast<int>(std::ranges::count(active, true));
}

// One line for each loop and kind of repair ("snapped ...", "closed ..."): the largest of them, with its move.
std::vector<std::string> repair_lines(const std::vector<LoopRepair>& repairs, bool notes) {
  struct Group {
    const LoopRepair* largest;
    int count = 0;
  };
  std::vector<std::pair<std::string, Group>> groups;
  for (const LoopRepair& repair : repairs) {
    if (repair.note != notes) continue;
    const std::string key = fmt::format("{} {}", repair.loop, repair.what.substr(0, repair.what.find(' ')));
    auto group = std::ranges::find(groups, key, [](const auto& g) { return g.first; });
    if (group == groups.end()) group = groups.insert(groups.end(), {key, {&repair}});
    if (repair.move > group->second.largest->move) group->second.largest = &repair;
    ++group->second.count;
  }
  std::vector<std::string> out;
  for (const auto& [key, group] : groups) {
    const LoopRepair& repair = *group.largest;
    out.push_back(
        fmt::format("loop {}: {} at (u, v) = ({}, {})", repair.loop, repair.what, repair.place.x(), repair.place.y()));
    if (repair.move > 0) out.back() += fmt::format(", by {:.2g}", repair.move);
    if (group.count > 1) out.back() += fmt::format("; {} such, this the largest move", group.count);
  }
  return out;
}

InspectedPanel inspect(const TrimmedSurface& source, const InspectOptions& options) {
  InspectedPanel panel;
  panel.face = source;
  panel.face.surface = refined(source, options);
  for (const TrimLoop& loop : panel.face.loops) panel.gaps.emplace_back(loop.index, gap(loop));
  const std::string who = fmt::format("panel '{}'", panel.face.name);
  panel.repairs = validate_loops(panel.face);
  for (const bool notes : {false, true}) {
    for (const std::string& line : repair_lines(panel.repairs, notes))
      (notes ? panel.notes : panel.warnings).push_back(fmt::format("{}: {}", who, line));
  }
  panel.topology = trace_trims(panel.face);
  panel.points = constraint_points(panel.face, panel.topology);
  panel.measure = measure(panel.face, panel.topology);
  panel.active_control_points = active_control_points(panel.face.surface, panel.topology);
  const Closure closure = find_closure(panel.face.surface, same_place(panel.face.resolution, panel.face.surface));
  merge_over_seams(close_exactly(panel.face.surface, closure), closure, panel.points);
  merge_near_points(panel.face.surface, panel.points);
  return panel;
}

// Loops by the file's number, with their length [unit of the net].
std::vector<std::pair<const TrimLoop*, double>> loops_in_file_order(const InspectedPanel& panel) {
  std::vector<std::pair<const TrimLoop*, double>> loops;
  for (std::size_t k = 0; k < panel.face.loops.size(); ++k) {
    loops.emplace_back(&panel.face.loops[k], panel.measure.loop_lengths[k]);
  }
  std::ranges::stable_sort(loops, {}, [](const auto& l) { return l.first->index; });
  return loops;
}

int curves_in_file(const TrimLoop& loop) {
  std::set<int> numbers;
  for (const TrimCurve& curve : loop.curves) numbers.insert(curve.index);
  return static_cast<int>(numbers.size());
}

double gap_as_read(const InspectedPanel& panel, int loop) {
  for (const auto& [index, size] : panel.gaps) {
    if (index == loop) return size;
  }
  return 0;
}

const char* name(LoopKind kind) {
  return kind == LoopKind::outer ? "outer" : "hole";
}

double perimeter(const InspectedPanel& panel) {
  double sum = 0;
  for (const double length : panel.measure.loop_lengths) sum += length;
  return sum * panel.face.metres_per_unit;
}

double area(const InspectedPanel& panel) {
  return panel.measure.area * panel.face.metres_per_unit * panel.face.metres_per_unit;
}

std::ptrdiff_t count_cells(const InspectedPanel& panel, CellKind kind) {
  return std::ranges::count(panel.topology.cells, kind);
}

Eigen::Vector3d position(const InspectedPanel& panel, double u, double v) {
  return panel.face.metres_per_unit * panel.face.surface(u, v);
}

nlohmann::ordered_json panel_json(const InspectedPanel& panel) {
  using Json = nlohmann::ordered_json;
  const NurbsSurface& surface = panel.face.surface;
  const Interval du = surface.u().domain(), dv = surface.v().domain();
  Json out = {{"name", utf8(panel.face.name)},
              {"degree", {surface.u().degree(), surface.v().degree()}},
              {"control_points", {surface.count_u(), surface.count_v()}},
              {"rational", surface.rational()},
              {"knots", Json::array({surface.u().knots(), surface.v().knots()})},
              {"domain", Json::array({{du.min, du.max}, {dv.min, dv.max}})},
              {"area", area(panel)},
              {"perimeter", perimeter(panel)},
              {"loops", Json::array()}};
  for (const auto& [loop, length] : loops_in_file_order(panel)) {
    out["loops"].push_back({{"kind", name(loop->kind)},
                            {"curves", curves_in_file(*loop)},
                            {"length", length * panel.face.metres_per_unit},
                            {"closed", true},
                            {"gap", gap_as_read(panel, loop->index)}});
  }
  out["cells"] = {{"inside", count_cells(panel, CellKind::inside)},
                  {"cut", count_cells(panel, CellKind::cut)},
                  {"outside", count_cells(panel, CellKind::outside)}};
  out["active_control_points"] = panel.active_control_points;
  const PredicateCounts& counts = panel.topology.counts;  // how often each level of arithmetic decided
  out["predicates"] = {{"signs", counts.coefficient_signs},
                       {"interval", counts.interval},
                       {"exact", counts.exact},
                       {"algebraic", counts.algebraic}};
  if (!panel.face.marks.empty()) out["marks"] = Json::array();
  for (const PanelMark& mark : panel.face.marks)
    out["marks"].push_back({{"kind", name(mark.kind)}, {"at", {mark.at.x(), mark.at.y()}}, {"text", utf8(mark.text)}});
  out["constraint_points"] = Json::array();
  for (const ConstraintPoint& point : panel.points) {
    const Eigen::Vector3d x = position(panel, point.u, point.v);
    Json row = {{"kind", name(point.kind)}, {"u", point.u}, {"v", point.v}, {"position", {x[0], x[1], x[2]}}};
    if (point.loop >= 0) {
      row["loop"] = point.loop;
      row["curve"] = point.curve;
      row["t"] = point.t;
    }
    row["used"] = point.used;
    if (!point.used) row["why"] = point.why;
    out["constraint_points"].push_back(std::move(row));
  }
  return out;
}

// ---- text ----

std::ptrdiff_t used_points(const InspectedPanel& panel) {
  return std::ranges::count(panel.points, true, &ConstraintPoint::used);
}

// One line a panel.
std::string overview(const Inspection& inspection) {
  std::size_t width = 8;
  for (const InspectedPanel& panel : inspection.panels)
    width = std::max(width, std::min<std::size_t>(24, panel.face.name.size()));
  std::string out = fmt::format("\n  {:<{}}  {:>11}  {:>11}  {:>6}  {:>9}  {:>16}  {:>9}  {:>11}\n", "panel", width,
                                "area m2", "perimeter m", "degree", "net", "cells in/cut/out", "loops", "points used");
  for (const InspectedPanel& panel : inspection.panels) {
    const NurbsSurface& surface = panel.face.surface;
    std::size_t curves = 0;
    for (const TrimLoop& loop : panel.face.loops) curves += static_cast<std::size_t>(curves_in_file(loop));
    out +=
        fmt::format("  {:<{}.{}}  {:>11.6g}  {:>11.6g}  {:>6}  {:>9}  {:>16}  {:>9}  {:>11}\n", panel.face.name, width,
                    width, area(panel), perimeter(panel),
                    fmt::format("{}x{}{}", surface.u().degree(), surface.v().degree(), surface.rational() ? "r" : ""),
                    fmt::format("{}x{}", surface.count_u(), surface.count_v()),
                    fmt::format("{}/{}/{}", count_cells(panel, CellKind::inside), count_cells(panel, CellKind::cut),
                                count_cells(panel, CellKind::outside)),
                    fmt::format("{} ({})", panel.face.loops.size(), curves),
                    fmt::format("{}/{}", used_points(panel), panel.points.size()));
  }
  return out;
}

// Loops and curves as a scene addresses them.
std::string curves_text(const InspectedPanel& panel) {
  const NurbsSurface& surface = panel.face.surface;
  const double metre = panel.face.metres_per_unit;
  const Interval du = surface.u().domain(), dv = surface.v().domain();
  std::string out =
      fmt::format("\npanel '{}'  u [{:.6g}, {:.6g}]  v [{:.6g}, {:.6g}]{}{}\n", panel.face.name, du.min, du.max, dv.min,
                  dv.max, panel.face.natural_bounds ? "  no trim: its border is loop 0" : "",
                  panel.face.marks.empty() ? "" : fmt::format("  {} marks", panel.face.marks.size()));
  for (const auto& [loop, length] : loops_in_file_order(panel)) {
    out +=
        fmt::format("  {:<10} {:>10.6g} m{}\n", name(loop->kind), length * metre,
                    gap_as_read(panel, loop->index) > 0 ? fmt::format("  gap {:.2g}", gap_as_read(panel, loop->index))
                                                        : std::string());
    const auto at = static_cast<int>(loop - panel.face.loops.data());
    for (std::size_t c = 0; c < loop->curves.size(); ++c) {
      const TrimCurve& curve = loop->curves[c];
      const double curve_length =
          CurveOnSurface(panel.face, panel.topology, at, static_cast<int>(c), surface).length() * metre;
      const auto place = [](const Eigen::Vector2d& p) { return fmt::format("({:.6g}, {:.6g})", p.x(), p.y()); };
      out += fmt::format("  {:<10} {:>10.6g} m  {:<24} {}{}\n", fmt::format("curve:{},{}", loop->index, curve.index),
                         curve_length, place(curve.curve.start()), place(curve.curve.end()),
                         curve.reversed ? "  (run backwards)" : "");
    }
  }
  return out;
}

std::string points_text(const InspectedPanel& panel) {
  std::string out = fmt::format("\npoints of '{}'\n  {:<12} {:>5}  {:>5}\n", panel.face.name, "kind", "all", "used");
  for (const PointKind kind : {PointKind::vertex, PointKind::crossing_u, PointKind::crossing_v, PointKind::tangent_u,
                               PointKind::tangent_v, PointKind::crossing_uv}) {
    const auto all = std::ranges::count(panel.points, kind, &ConstraintPoint::kind);
    const auto used =
        std::ranges::count_if(panel.points, [&](const ConstraintPoint& p) { return p.kind == kind && p.used; });
    if (all > 0) out += fmt::format("  {:<12} {:>5}  {:>5}\n", toile::name(kind), all, used);
  }
  constexpr std::size_t shown = 400;
  out += "\n  kind         u            v            curve        t            used\n";
  for (std::size_t k = 0; k < std::min(shown, panel.points.size()); ++k) {
    const ConstraintPoint& p = panel.points[k];
    const bool on_curve = p.loop >= 0;
    out += fmt::format("  {:<12} {:<12.7g} {:<12.7g} {:<12} {:<12} {}\n", toile::name(p.kind), p.u, p.v,
                       on_curve ? fmt::format("{},{}", p.loop, p.curve) : "-",
                       on_curve ? fmt::format("{:.7g}", p.t) : "-", p.used ? "yes" : "no: " + p.why);
  }
  if (panel.points.size() > shown) {
    out += fmt::format("  and {} more: --json lists all\n", panel.points.size() - shown);
  }
  return out;
}

}  // namespace

NurbsSurface refined(const TrimmedSurface& face, const InspectOptions& options) {
  NurbsSurface surface = face.surface;
  if (!surface.u().clamped() || !surface.v().clamped()) surface = clamp(surface);
  if (!options.degree && !options.span && !options.spans) return surface;
  RefineOptions refinement;
  refinement.degree = options.degree;
  if (options.span) refinement.span = *options.span / face.metres_per_unit;
  if (options.spans) refinement.spans = {*options.spans, *options.spans};
  refinement.tolerance = same_place(face.resolution, surface);
  try {
    return refine(surface, refinement).surface;
  } catch (const GeometryError& error) {
    throw GeometryError(fmt::format("{}: panel '{}': {}", face.source, face.name, error.what()));
  }
}

namespace {

// body(k) for every k below `count`, each by the first thread that is free; what each threw.
template <class Body>
std::vector<std::exception_ptr> deal_out(std::size_t count, int threads, const Body& body) {
  if (threads <= 0) threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::vector<std::exception_ptr> errors(count);
  Workers(static_cast<int>(std::min<std::size_t>(threads, count))).run(static_cast<int>(count), [&](int part) {
    const auto k = static_cast<std::size_t>(part);
    try {
      body(k);
    } catch (...) {
      errors[k] = std::current_exception();
    }
  });
  return errors;
}

}  // namespace

Inspection inspect(const PanelFile& file, const InspectOptions& options) {
  Inspection out;
  out.file = file.path;
  out.unit = file.unit;
  out.exporter = file.exporter;
  out.entities = file.entities;
  out.warnings = file.warnings;
  out.notes = file.notes;
  out.refused = file.refused;
  out.size = file.size;
  out.sizes = file.sizes;
  out.ledger = file.ledger;
  std::vector<std::optional<InspectedPanel>> panels(file.panels.size());
  const std::vector<std::exception_ptr> errors =
      deal_out(panels.size(), options.threads, [&](std::size_t k) { panels[k] = inspect(file.panels[k], options); });
  for (std::size_t k = 0; k < panels.size(); ++k) {
    try {
      if (errors[k]) std::rethrow_exception(errors[k]);
    } catch (const GeometryError& error) {
      if (panels.size() == 1) throw;
      out.refused.emplace_back(error.what());
      continue;
    }
    out.warnings.insert(out.warnings.end(), panels[k]->warnings.begin(), panels[k]->warnings.end());
    out.notes.insert(out.notes.end(), panels[k]->notes.begin(), panels[k]->notes.end());
    out.panels.push_back(*std::move(panels[k]));
    panels[k].reset();
  }
  if (out.panels.empty() && !out.refused.empty()) throw GeometryError(out.refused.front());
  return out;
}

namespace {

const char* name(Disposition disposition) {
  switch (disposition) {
    case Disposition::read:
      return "read";
    case Disposition::converted:
      return "converted";
    case Disposition::kept:
      return "kept as it is";
    case Disposition::quarantined:
      return "quarantined";
  }
  return "";
}

}  // namespace

nlohmann::ordered_json ledger_json(const std::vector<LedgerEntry>& ledger) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const LedgerEntry& entry : ledger) {
    nlohmann::ordered_json row = {{"entry", entry.sequence},
                                  {"line", entry.line},
                                  {"entity", entry.type},
                                  {"form", entry.form},
                                  {"disposition", name(entry.disposition)}};
    if (!entry.why.empty()) row["why"] = utf8(entry.why);
    out.push_back(std::move(row));
  }
  return out;
}

std::string ledger_text(const std::vector<LedgerEntry>& ledger) {
  if (ledger.empty()) return {};
  struct Row {
    const LedgerEntry* first = nullptr;
    int count = 0;
  };
  std::map<std::pair<int, Disposition>, Row> rows;
  for (const LedgerEntry& entry : ledger) {
    Row& row = rows[{entry.type, entry.disposition}];
    if (row.count++ == 0) row.first = &entry;
  }
  std::string out = "  entity  count  what became of it\n";
  for (const auto& [key, row] : rows) {
    out += fmt::format("  {:>6} {:>6}  {}", key.first, row.count, name(key.second));
    if (!row.first->why.empty())
      out += row.count == 1 ? fmt::format(": line {}: {}", row.first->line, row.first->why)
                            : fmt::format(": first at line {}: {}", row.first->line, row.first->why);
    out += '\n';
  }
  return out;
}

nlohmann::ordered_json inspect_json(const Inspection& inspection, int threads) {
  nlohmann::ordered_json entities = nlohmann::ordered_json::object();
  for (const auto& [type, count] : inspection.entities) entities[std::to_string(type)] = count;
  nlohmann::ordered_json panels = std::vector<nlohmann::ordered_json>(inspection.panels.size());
  for (const std::exception_ptr& error :
       deal_out(panels.size(), threads, [&](std::size_t k) { panels[k] = panel_json(inspection.panels[k]); }))
    if (error) std::rethrow_exception(error);
  nlohmann::ordered_json warnings = nlohmann::ordered_json::array();
  for (const std::string& warning : inspection.warnings) warnings.push_back(utf8(warning));
  nlohmann::ordered_json notes = nlohmann::ordered_json::array();
  for (const std::string& note : inspection.notes) notes.push_back(utf8(note));
  nlohmann::ordered_json refused = nlohmann::ordered_json::array();
  for (const std::string& panel : inspection.refused) refused.push_back(utf8(panel));
  return {{"file", utf8(inspection.file)},
          {"unit", utf8(inspection.unit)},
          {"exporter", utf8(inspection.exporter)},
          {"warnings", std::move(warnings)},
          {"size", inspection.size},
          {"sizes", inspection.sizes},
          {"notes", std::move(notes)},
          {"entities", std::move(entities)},
          {"panels", std::move(panels)},
          {"refused", std::move(refused)},
          {"ledger", ledger_json(inspection.ledger)}};
}

std::string inspect_text(const Inspection& inspection, bool points) {
  std::string out = fmt::format("{}  {}{}\n", inspection.file, inspection.unit,
                                inspection.exporter.empty() ? "" : ", written by " + inspection.exporter);
  if (inspection.sizes.size() > 1)
    out += fmt::format("  sizes        {} (read: {}; --size chooses)\n", fmt::join(inspection.sizes, ", "),
                       inspection.size.empty() ? "see the warnings" : inspection.size);
  out += ledger_text(inspection.ledger);
  constexpr std::size_t shown = 12;
  for (std::size_t k = 0; k < inspection.warnings.size() && (points || k < shown); ++k) {
    out += "  warning      " + inspection.warnings[k] + '\n';
  }
  if (!points && inspection.warnings.size() > shown) {
    out += fmt::format("  and {} warnings more: -v lists all\n", inspection.warnings.size() - shown);
  }
  for (std::size_t k = 0; points && k < inspection.notes.size(); ++k)
    out += "  note         " + inspection.notes[k] + '\n';
  for (const std::string& panel : inspection.refused) out += "  refused      " + panel + '\n';
  if (inspection.panels.empty()) return out + "  no panel\n";
  out += overview(inspection);
  for (const InspectedPanel& panel : inspection.panels) out += curves_text(panel);
  if (points) {
    for (const InspectedPanel& panel : inspection.panels) out += points_text(panel);
  } else {
    out += "\n-v lists the constraint points, --svg, --png or --html draw them\n";
  }
  return out;
}

}  // namespace toile
