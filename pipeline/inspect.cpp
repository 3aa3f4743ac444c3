#include "pipeline/inspect.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "analysis/extension.h"
#include "analysis/projection/select_rows.h"
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

// Which points the projection takes, with the default fabric and nothing pinned.
void decide_used(InspectedPanel& panel) {
  const TrimmedSurface& face = panel.face;
  const NurbsSurface rest = face.surface.with_points(face.metres_per_unit * face.surface.points());
  ShellPanel shell{face.name, rest, quadrature(face, panel.topology), Fabric{}, 0};
  const Eigen::VectorXd row_sums = ShellModel({shell}).lumped_mass();
  Extension extension = extend(rest, shell.quadrature, row_sums);
  shell.rest = std::move(extension.rest);
  const ShellModel model({shell});
  const AffineMap map(extension.dependence, {}, {});
  const Eigen::VectorXd floor = mass_floor(shell.rest, shell.fabric.density);
  Eigen::VectorXd mass = map.reduce_scalar(model.lumped_mass());
  for (Eigen::Index k = 0; k < mass.size(); ++k) {
    mass[k] = std::max(mass[k], floor[map.node_control_point()[static_cast<std::size_t>(k)]]);
  }
  std::vector<std::vector<ConstraintPoint>> points{panel.points};
  select_rows(model, map, mass, points, {});
  panel.points = std::move(points.front());
}

// Degree 1 and kinks have no second derivatives to strain rows' neighbours: such a face is refined before it is draped.
bool carries_a_shell(const NurbsSurface& surface) {
  for (const Direction d : {Direction::u, Direction::v}) {
    const KnotVector& knots = surface.knots(d);
    if (knots.degree() < 2) return false;
    const std::vector<double> breaks = knots.breaks();
    for (std::size_t k = 1; k + 1 < breaks.size(); ++k) {
      if (knots.multiplicity(breaks[k]) >= knots.degree()) return false;
    }
  }
  return true;
}

InspectedPanel inspect(const TrimmedSurface& source, const InspectOptions& options) {
  InspectedPanel panel;
  panel.face = source;
  panel.face.surface = refined(source, options);
  for (const TrimLoop& loop : panel.face.loops) panel.gaps.emplace_back(loop.index, gap(loop));
  const std::string who = fmt::format("panel '{}'", panel.face.name);
  panel.repairs = validate_loops(panel.face);
  for (const LoopRepair& repair : panel.repairs) {
    panel.warnings.push_back(fmt::format("{}: loop {}: {} at (u, v) = ({}, {})", who, repair.loop, repair.what,
                                         repair.place.x(), repair.place.y()));
  }
  panel.topology = trace_trims(panel.face);
  panel.points = constraint_points(panel.face, panel.topology);
  panel.measure = measure(panel.face, panel.topology);
  panel.active_control_points = active_control_points(panel.face.surface, panel.topology);
  if (options.select_rows && carries_a_shell(panel.face.surface)) {
    decide_used(panel);
  } else if (options.select_rows) {
    panel.warnings.push_back(who +
                             ": degree 1 or a kink at these knots: a drape refines it first; which points it takes "
                             "shows with --degree 2");
  }
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
  refinement.tolerance = std::max(face.resolution, 1e-9 * bounding_box(surface).diagonal().norm());
  try {
    return refine(surface, refinement).surface;
  } catch (const GeometryError& error) {
    throw GeometryError(fmt::format("{}: panel '{}': {}", face.source, face.name, error.what()));
  }
}

Inspection inspect(const PanelFile& file, const InspectOptions& options) {
  Inspection out;
  out.file = file.path;
  out.unit = file.unit;
  out.exporter = file.exporter;
  out.entities = file.entities;
  out.warnings = file.warnings;
  for (const LedgerEntry& entry : file.ledger) {
    if (entry.disposition == Disposition::converted || entry.disposition == Disposition::quarantined) {
      out.ledger.push_back(entry);
    }
  }
  for (const TrimmedSurface& face : file.panels) {
    out.panels.push_back(inspect(face, options));
    const auto& warnings = out.panels.back().warnings;
    out.warnings.insert(out.warnings.end(), warnings.begin(), warnings.end());
  }
  return out;
}

nlohmann::ordered_json inspect_json(const Inspection& inspection) {
  nlohmann::ordered_json entities = nlohmann::ordered_json::object();
  for (const auto& [type, count] : inspection.entities) entities[std::to_string(type)] = count;
  nlohmann::ordered_json panels = nlohmann::ordered_json::array();
  for (const InspectedPanel& panel : inspection.panels) panels.push_back(panel_json(panel));
  nlohmann::ordered_json warnings = nlohmann::ordered_json::array();
  for (const std::string& warning : inspection.warnings) warnings.push_back(utf8(warning));
  return {{"file", utf8(inspection.file)},   {"unit", utf8(inspection.unit)},   {"exporter", utf8(inspection.exporter)},
          {"warnings", std::move(warnings)}, {"entities", std::move(entities)}, {"panels", std::move(panels)}};
}

std::string inspect_text(const Inspection& inspection, bool points) {
  std::string out = fmt::format("{}  {}{}\n", inspection.file, inspection.unit,
                                inspection.exporter.empty() ? "" : ", written by " + inspection.exporter);
  if (!inspection.entities.empty()) out += "  entities   ";
  for (const auto& [type, count] : inspection.entities) out += fmt::format(" {} x {}", count, type);
  if (!inspection.entities.empty()) out += '\n';
  // Converted entities by type; what is left out one by one.
  std::map<std::pair<int, std::string>, int> converted;
  for (const LedgerEntry& entry : inspection.ledger) {
    if (entry.disposition == Disposition::converted) {
      ++converted[{entry.type, entry.why}];
    } else {
      out += fmt::format("  left out     line {}: entity {}: {}\n", entry.line, entry.type, entry.why);
    }
  }
  for (const auto& [what, count] : converted) {
    out += fmt::format("  converted    {} x {}: {}\n", count, what.first, what.second);
  }
  constexpr std::size_t shown = 12;
  for (std::size_t k = 0; k < inspection.warnings.size() && (points || k < shown); ++k) {
    out += "  warning      " + inspection.warnings[k] + '\n';
  }
  if (!points && inspection.warnings.size() > shown) {
    out += fmt::format("  and {} warnings more: -v lists all\n", inspection.warnings.size() - shown);
  }
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
