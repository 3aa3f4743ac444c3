// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/inspect/inspect.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <optional>
#include <set>
#include <thread>

#include "analysis/constraint/select_rows.h"
#include "analysis/parallel/workers.h"
#include "geometry/error.h"
#include "geometry/measure.h"
#include "pipeline/build/places.h"
#include "pipeline/inspect/facts.h"

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
    if (group.count > 1) out.back() += fmt::format("; {} such repairs, this one the largest", group.count);
  }
  return out;
}

}  // namespace

InspectedPanel inspect(TrimmedSurface face, const InspectOptions& options) {
  InspectedPanel panel;
  face.surface = refined(face, options);
  for (const TrimLoop& loop : face.loops) panel.gaps.emplace_back(loop.index, gap(loop));
  static_cast<PanelTrace&>(panel) = trace_panel(std::move(face), PointRule::knot_mesh);
  const std::string who = fmt::format("panel '{}'", panel.face.name);
  for (const bool notes : {false, true}) {
    for (const std::string& line : repair_lines(panel.repairs, notes))
      (notes ? panel.notes : panel.warnings).push_back(fmt::format("{}: {}", who, line));
  }
  panel.measure = measure(panel.face, panel.topology);
  // A strip as wide as places that count as one, and as long as half of its border, would have this area.
  const double least =
      same_place(panel.face.resolution, panel.face.surface) * panel.face.metres_per_unit * perimeter(panel) / 2;
  if (!(area(panel) > least))
    panel.warnings.push_back(fmt::format(
        "{}: it has no area, {:.3g} m2 within a border of {:.3g} m: its surface is a line or a point, or the "
        "cloth is narrower than the file's resolution; draft it anew",
        who, area(panel), perimeter(panel)));
  panel.active_control_points = active_control_points(panel.face.surface, panel.topology);
  merge_near_points(panel.face.surface, panel.points);
  return panel;
}

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

namespace {

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
                               PointKind::tangent_v, PointKind::crossing_uv, PointKind::corner}) {
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
  RefineOptions asked;
  asked.degree = options.degree;
  if (options.span) asked.span = *options.span / face.metres_per_unit;
  if (options.spans) asked.spans = {*options.spans, *options.spans};
  return refined(face, asked, fmt::format("{}: panel '{}'", face.source, face.name));
}

std::vector<std::exception_ptr> each_panel(std::size_t count, int threads,
                                           const std::function<void(std::size_t)>& body) {
  if (threads <= 0) threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::vector<std::exception_ptr> errors(count);
  Workers(static_cast<int>(std::min<std::size_t>(threads, count))).run(static_cast<int>(count), [&](int part) {
    const auto k = static_cast<std::size_t>(part);
    try {
      body(k);
    } catch (const GeometryError&) {
      errors[k] = std::current_exception();
    }
  });
  return errors;
}

std::vector<std::string> refusals(std::vector<std::string> refused, const std::vector<std::exception_ptr>& errors) {
  std::size_t failed = 0;
  for (const std::exception_ptr& error : errors) {
    if (!error) continue;
    ++failed;
    try {
      std::rethrow_exception(error);
    } catch (const GeometryError& of_panel) {
      refused.emplace_back(of_panel.what());
    }
  }
  if (!refused.empty() && failed == errors.size()) throw GeometryError(refused.front());
  return refused;
}

Inspection facts_of(PanelFile file) {
  Inspection out;
  out.file = std::move(file.path);
  out.unit = std::move(file.unit);
  out.exporter = std::move(file.exporter);
  out.entities = std::move(file.entities);
  out.ledger = std::move(file.ledger);
  out.warnings = std::move(file.warnings);
  out.notes = std::move(file.notes);
  out.size = std::move(file.size);
  out.sizes = std::move(file.sizes);
  out.refused = std::move(file.refused);
  return out;
}

void append_messages(const InspectedPanel& panel, Inspection& facts) {
  facts.warnings.insert(facts.warnings.end(), panel.warnings.begin(), panel.warnings.end());
  facts.notes.insert(facts.notes.end(), panel.notes.begin(), panel.notes.end());
}

Inspection inspect(PanelFile file, const InspectOptions& options) {
  std::vector<TrimmedSurface> faces = std::move(file.panels);
  Inspection out = facts_of(std::move(file));
  std::vector<std::optional<InspectedPanel>> panels(faces.size());
  out.refused = refusals(std::move(out.refused), each_panel(panels.size(), options.threads, [&](std::size_t k) {
                           panels[k] = inspect(std::move(faces[k]), options);
                         }));
  for (std::optional<InspectedPanel>& panel : panels) {
    if (!panel) continue;
    append_messages(*panel, out);
    out.panels.push_back(*std::move(panel));
    panel.reset();
  }
  return out;
}

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
    out += fmt::format("  and {} more warnings: -v lists all\n", inspection.warnings.size() - shown);
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
