// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/build/build.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/constraint/averaged_rows.h"
#include "analysis/map/extension.h"
#include "analysis/shell/shell_model.h"
#include "geometry/clock.h"
#include "geometry/error.h"
#include "geometry/measure.h"
#include "geometry/refine.h"
#include "io/panel_file.h"
#include "pipeline/build/contact.h"
#include "pipeline/build/obstacles.h"
#include "pipeline/build/places.h"
#include "trimming/quadrature.h"

namespace toile {
namespace {

std::string face_names(const PanelFile& file) {
  std::string names;
  for (const TrimmedSurface& face : file.panels) names += (names.empty() ? "'" : ", '") + face.name + "'";
  return names;
}

// What the file means and can't be: one of it may be what is looked for.
std::string refusals(const PanelFile& file) {
  std::string out;
  for (const std::string& reason : file.refused) out += "\n  left out: " + reason;
  return out;
}

const TrimmedSurface* by_name(const PanelFile& file, const std::string& name) {
  const auto it = std::ranges::find(file.panels, name, &TrimmedSurface::name);
  return it == file.panels.end() ? nullptr : &*it;
}

// The face that a scene's panel means: by name, else by order.
const TrimmedSurface& select_face(const PanelFile& file, const ScenePanel& panel) {
  require_panels(file);
  if (panel.named) {
    if (const TrimmedSurface* face = by_name(file, panel.name)) return *face;
    if (const TrimmedSurface* face = by_name(file, panel.name + std::string(flat_suffix))) return *face;
    const bool anonymous = std::ranges::all_of(file.panels, [](const TrimmedSurface& f) { return f.name.empty(); });
    if (file.panels.size() > 1 && !anonymous) {
      throw InputError(fmt::format("{}: no face of {} is called '{}'; it has {}{}", panel.where, file.path, panel.name,
                                   face_names(file), refusals(file)));
    }
  }
  if (panel.order >= static_cast<int>(file.panels.size())) {
    throw InputError(fmt::format("{}: panel '{}' would be face {} of {}, which has {}", panel.where, panel.name,
                                 panel.order + 1, file.path, file.panels.size()));
  }
  return file.panels[static_cast<std::size_t>(panel.order)];
}

NurbsSurface placed(const NurbsSurface& surface, double metres_per_unit, const Placement& place) {
  Eigen::Matrix3Xd points = place.rotation() * (metres_per_unit * surface.points());
  points.colwise() += place.translate;
  return surface.with_points(std::move(points));
}

void refuse_tears(const NurbsSurface& surface, const std::string& who) {
  for (const Direction d : {Direction::u, Direction::v}) {
    const KnotVector& knots = surface.knots(d);
    const char axis = d == Direction::u ? 'u' : 'v';
    if (knots.degree() < 2) {
      throw GeometryError(
          fmt::format("{}: degree {} in {} can't bend; give refine = {{ degree = 2 }}", who, knots.degree(), axis));
    }
    const std::vector<double> breaks = knots.breaks();
    for (std::size_t k = 1; k + 1 < breaks.size(); ++k) {
      if (knots.multiplicity(breaks[k]) > knots.degree()) {
        throw GeometryError(
            fmt::format("{}: the surface is torn along the knot line {} = {} (multiplicity {} at degree {}); split the "
                        "panel there",
                        who, axis, breaks[k], knots.multiplicity(breaks[k]), knots.degree()));
      }
    }
  }
}

// The surface at analysis resolution, unit of the file.
NurbsSurface analysis_surface(const TrimmedSurface& source, const ScenePanel& panel, const std::string& who,
                              std::vector<std::string>& warnings) {
  if (!source.surface.u().clamped() || !source.surface.v().clamped())
    warnings.push_back(who + ": its knots were clamped");
  RefineOptions options;
  if (!panel.start) {
    options.degree = panel.degree.value_or(2);
    if (panel.span) options.span = *panel.span / source.metres_per_unit;
    options.spans = panel.spans;
    options.control_points = panel.control_points;
  }
  NurbsSurface surface = refined(source, options, who);
  refuse_tears(surface, who);
  return surface;
}

char letter(Direction d) {
  return d == Direction::u ? 'u' : 'v';
}

void warn_of_seams(const BuiltPanel& built, const std::string& who, std::vector<std::string>& warnings) {
  const NurbsSurface& surface = built.face.surface;
  const double tolerance = same_place(built.source.resolution, surface);
  const Closure ends = find_closure(surface, tolerance);
  for (const Direction d : {Direction::u, Direction::v}) {
    if (!ends_meet(surface, d, tolerance)) continue;
    const Interval domain = surface.knots(d).domain();
    const char* what = built.closure.in(d) ? "meet and are glued: the panel is closed there"
                       : ends.in(d)        ? "meet, but the trims part the cloth there: it stays open"
                                           : "have the same control points, but other weights: they stay apart";
    warnings.push_back(
        fmt::format("{}: the edges {} = {} and {} = {} {}", who, letter(d), domain.min, letter(d), domain.max, what));
  }
}

// Does the material touch the edge of the domain along more than a point?
bool cloth_on_edge(const TrimTopology& topology, Direction d, int end) {
  const KnotMesh& mesh = topology.mesh;
  const bool is_u = d == Direction::u;
  const int cells = is_u ? mesh.cells_u() : mesh.cells_v(), along = is_u ? mesh.cells_v() : mesh.cells_u();
  const int line = end == 0 ? 0 : cells - 1;
  for (int k = 0; k < along; ++k) {
    const int cell = is_u ? mesh.cell(line, k) : mesh.cell(k, line);
    if (topology.cells[static_cast<std::size_t>(cell)] == CellKind::inside) return true;
  }
  const double edge = end == 0 ? (is_u ? mesh.u : mesh.v).front() : (is_u ? mesh.u : mesh.v).back();
  const int axis = is_u ? 0 : 1;
  for (const CutCell& cell : topology.cut_cells) {
    if ((is_u ? cell.i : cell.j) != line) continue;
    for (const std::vector<BoundaryPiece>& loop : cell.loops) {
      for (const BoundaryPiece& piece : loop) {
        if (piece.from[axis] == edge && piece.to[axis] == edge) return true;
      }
    }
  }
  return false;
}

// At a pole weft and warp have no direction.
void refuse_poles(const BuiltPanel& built, const std::string& who) {
  const NurbsSurface& surface = built.face.surface;
  for (const Direction d : {Direction::u, Direction::v}) {
    for (const int end : {0, 1}) {
      if (!collapsed(surface, d, end, same_place(built.source.resolution, surface)) ||
          !cloth_on_edge(built.topology, d, end))
        continue;
      const Interval domain = surface.knots(d).domain();
      throw GeometryError(
          fmt::format("{}: the edge {} = {} is one point, at which weft and warp have no direction; trim the cloth "
                      "around it away or draft the panel without a pole",
                      who, letter(d), end == 0 ? domain.min : domain.max));
    }
  }
}

// Row sums of the mass matrix of a panel, SI.
Eigen::VectorXd row_sums(const NurbsSurface& rest, const CutQuadrature& rule, double density) {
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(rest.points().cols());
  SurfaceBasis basis;
  for (std::size_t k = 0; k < rule.points.size(); ++k) {
    evaluate_basis(rest, rule.points[k].x(), rule.points[k].y(), basis);
    const SurfaceJet jet = evaluate(rest, rule.points[k].x(), rule.points[k].y());
    const double m = rule.weights[k] * density * jet.area_scale();
    for (int b = 0; b < basis.count_v; ++b) {
      for (int a = 0; a < basis.count_u; ++a) {
        mass[rest.index(basis.first_u + a, basis.first_v + b)] +=
            m * basis.value[0][static_cast<std::size_t>(a + basis.count_u * b)];
      }
    }
  }
  return mass;
}

NurbsSurface start_surface(const PanelFile& file, const ScenePanel& panel, const NurbsSurface& rest) {
  const TrimmedSurface* face = by_name(file, *panel.start);
  if (!face) {
    throw InputError(fmt::format("{}: start: no face of {} is called '{}'; it has {}", panel.where, file.path,
                                 *panel.start, face_names(file)));
  }
  if (panel.degree || panel.span || panel.spans || panel.control_points) {
    throw InputError(panel.where + ": a panel with a start uses the file's own knots; leave refine out");
  }
  NurbsSurface start = face->surface;
  if (!start.u().clamped() || !start.v().clamped()) start = clamp(start);
  if (start.u() != rest.u() || start.v() != rest.v() || start.weights() != rest.weights()) {
    throw InputError(fmt::format("{}: start: '{}' has other degrees, knots or weights than '{}'", panel.where,
                                 *panel.start, panel.name));
  }
  return start;
}

struct PanelParts {
  BuiltPanel built;
  ClothPanel panel;
  Eigen::Matrix3Xd start;
  AffineMap::Matrix dependence;
};

PanelParts build_panel(const PanelFile& file, const ScenePanel& panel, PointRule sampling,
                       std::vector<std::string>& warnings, std::vector<std::string>& notes) {
  const std::string who = fmt::format("{}: panel '{}'", panel.where, panel.name);
  PanelParts parts;
  BuiltPanel& built = parts.built;
  built.name = panel.name;
  built.source = select_face(file, panel);
  TrimmedSurface face = built.source;
  if (face.name.empty()) face.name = panel.name;
  face.surface = analysis_surface(built.source, panel, who, warnings);
  const double unit = face.metres_per_unit;
  static_cast<PanelTrace&>(built) = trace_panel(std::move(face), sampling);
  for (const LoopRepair& repair : built.repairs) {
    (repair.note ? notes : warnings).push_back(fmt::format("{}: loop {}: {}", who, repair.loop, repair.what));
  }
  warn_of_seams(built, who, warnings);
  refuse_poles(built, who);
  CutQuadrature rule = quadrature(built.face, built.topology, shell_quadrature(built.face.surface));
  if (!(rule.area > 0)) throw GeometryError(who + ": the trim leaves no material");
  const NurbsSurface rest = placed(built.face.surface, unit, panel.place);
  Extension extension = extend(rest, rule, row_sums(rest, rule, panel.fabric.density), {}, built.leader);
  built.carries_cloth = extension.carries_cloth;
  built.extended = extension.extended;
  built.extension_deviation = extension.deviation;
  parts.dependence = std::move(extension.dependence);
  std::vector<KinkPoint> kinks = kink_points(built.face, built.topology, built.closure);
  built.smooth_seams = tie_smooth_seams(
      extension.rest, built.closure, unit * same_place(built.source.resolution, built.face.surface), parts.dependence);
  if (built.smooth_seams.any()) {
    extension.rest = extension.rest.with_points(extension.rest.points() * parts.dependence.transpose());
    drop_strips(built.face.surface, built.smooth_seams, kinks);
    if (sampling == PointRule::border || sampling == PointRule::greville_derivative)
      drop_extra_points(built.face.surface, built.smooth_seams, built.extra_points);
  }
  parts.start = extension.rest.points();
  if (panel.start) {
    NurbsSurface start = start_surface(file, panel, built.face.surface);
    for (std::size_t k = 0; k < built.leader.size(); ++k) {
      const Eigen::Vector3d gap =
          start.points().col(static_cast<Eigen::Index>(k)) - start.points().col(built.leader[k]);
      if (!(gap.norm() <= same_place(built.source.resolution, start))) {
        throw InputError(fmt::format("{}: start: '{}' is open where '{}' is closed at its seam", panel.where,
                                     *panel.start, panel.name));
      }
    }
    parts.start = placed(start, unit, panel.place).points();
  }
  parts.panel = {panel.name,
                 std::move(extension.rest),
                 std::move(rule),
                 panel.fabric,
                 panel.grain.value_or(grain_angle(built.source).value_or(0)),
                 mean_u_direction(rest),
                 std::move(kinks)};
  return parts;
}

std::vector<std::unique_ptr<Obstacle>> obstacles_of(Build& result) {
  BuiltObstacles built = build_obstacles(result.scene);
  if (!built.faults.empty()) throw InputError(fmt::format("{}", fmt::join(built.faults, "\n")));
  result.warnings.insert(result.warnings.end(), built.warnings.begin(), built.warnings.end());
  result.notes.insert(result.notes.end(), built.notes.begin(), built.notes.end());
  return std::move(built.obstacles);
}

}  // namespace

int Build::panel(const std::string& name) const {
  for (std::size_t k = 0; k < panels.size(); ++k) {
    if (panels[k].name == name) return static_cast<int>(k);
  }
  throw InputError(fmt::format("no panel is called '{}'", name));
}

Build build(Scene scene, std::optional<std::vector<std::unique_ptr<Obstacle>>> obstacles) {
  Build result;
  result.scene = std::move(scene);
  const Clock::time_point reading = Clock::now();
  std::vector<std::size_t> file_of;
  std::vector<PanelChoice> choices;  // of result.files
  for (const ScenePanel& panel : result.scene.panels) {
    const std::string path = panel.file.string();
    auto it = result.files.begin();
    while (it != result.files.end() &&
           !(it->path == path && choices[static_cast<std::size_t>(it - result.files.begin())] == panel.choice))
      ++it;
    if (it == result.files.end()) {
      const std::shared_ptr<const ReadFile>& read = result.scene.read;
      const bool known = read && read->file.path == path && read->choice == panel.choice;
      result.files.push_back(known ? read->file : read_panels(panel.file, panel.choice));
      result.files.back().path = path;
      choices.push_back(panel.choice);
      for (const std::string& warning : result.files.back().warnings) result.warnings.push_back(warning);
      for (const std::string& note : result.files.back().notes) result.notes.push_back(note);
      for (const std::string& refusal : result.files.back().refused) result.warnings.push_back("left out: " + refusal);
      it = result.files.end() - 1;
    }
    file_of.push_back(static_cast<std::size_t>(it - result.files.begin()));
  }
  result.read_seconds = since(reading);

  const Clock::time_point trimming = Clock::now();
  std::vector<ClothPanel> panels;
  std::vector<Eigen::Triplet<double>> dependence;
  std::vector<Eigen::Matrix3Xd> starts;
  int count = 0;
  for (std::size_t k = 0; k < file_of.size(); ++k) {
    PanelParts parts = build_panel(result.files[file_of[k]], result.scene.panels[k], result.scene.strain_limit.points,
                                   result.warnings, result.notes);
    for (int row = 0; row < parts.dependence.outerSize(); ++row) {
      for (AffineMap::Matrix::InnerIterator it(parts.dependence, row); it; ++it) {
        dependence.emplace_back(count + static_cast<int>(it.row()), count + static_cast<int>(it.col()), it.value());
      }
    }
    count += static_cast<int>(parts.start.cols());
    starts.push_back(std::move(parts.start));
    panels.push_back(std::move(parts.panel));
    result.panels.push_back(std::move(parts.built));
  }
  // A point that is held pulls hardest: strain is limited there too, wherever it lies in its cell.
  for (const ScenePin& pin : result.scene.pins) {
    if (pin.at.kind != Address::Kind::uv) continue;
    BuiltPanel& panel = result.panels[static_cast<std::size_t>(result.panel(pin.panel))];
    ConstraintPoint point;
    point.u = pin.at.uv.x();
    point.v = pin.at.uv.y();
    panel.extra_points.push_back(point);
  }
  result.dependence.resize(count, count);
  result.dependence.setFromTriplets(dependence.begin(), dependence.end());
  result.model = std::make_unique<ShellModel>(std::move(panels));
  if (result.scene.strain_limit.on) {
    for (std::size_t k = 0; k < result.panels.size(); ++k) {
      BuiltPanel& panel = result.panels[k];
      panel.mean_rows = averaged_rows(*result.model, static_cast<int>(k), panel.topology, panel.closure,
                                      result.scene.strain_limit.points);
    }
  }
  result.trim_seconds = since(trimming);

  result.start.resize(3 * count);
  result.mass_floor.resize(count);
  for (std::size_t k = 0; k < starts.size(); ++k) {
    const int first = result.model->first_point(static_cast<int>(k));
    result.start.segment(3 * first, starts[k].size()) = starts[k].reshaped();
    const ClothPanel& panel = result.model->panels()[k];
    result.mass_floor.segment(first, starts[k].cols()) = mass_floor(panel.rest, panel.fabric.density);
  }
  // A start from a file satisfies the dependence to rounding only where that file came from the same panel.
  const AffineMap free(result.dependence, {}, {});
  const Eigen::VectorXd nodes = free.restrict(result.start);
  free.expand(nodes, 0, result.start);

  // On the way to rest there is no drag but what the wind does to cloth that stands still.
  Loads& loads = result.loads;
  loads.wind = result.scene.wind;
  loads.force.resize(3 * count);
  for (int i = 0; i < count; ++i) {
    loads.force.segment<3>(3 * i) = result.model->lumped_mass()[i] * result.scene.gravity;
    if (result.scene.rest) loads.force.segment<3>(3 * i) += result.model->lumped_drag()[i] * loads.wind;
  }
  if (result.scene.rest) loads.wind.setZero();
  for (std::size_t t = 0; t < result.scene.tractions.size(); ++t) {
    const SceneTraction& traction = result.scene.tractions[t];
    const int k = result.panel(traction.panel);
    const BuiltPanel& panel = result.panels[static_cast<std::size_t>(k)];
    const Eigen::Matrix3Xd start = result.net(k, result.start);
    const NurbsSurface& rest = result.rest(k);
    const std::string who = fmt::format("{}: traction {} ({})", traction.where, t, traction.along.text);
    const PanelPlaces places{panel.name, panel.face, panel.topology, rest, start, panel.carries_cloth};
    const int first = result.model->first_point(k);
    SurfaceBasis basis;
    for (const LinePoint& point : line_points(traction.along, places, who)) {
      evaluate_basis(rest, point.uv.x(), point.uv.y(), basis);
      for (int b = 0; b < basis.count_v; ++b) {
        for (int a = 0; a < basis.count_u; ++a) {
          const int i = first + rest.index(basis.first_u + a, basis.first_v + b);
          loads.force.segment<3>(3 * i) +=
              point.weight * basis.value[0][static_cast<std::size_t>(a + basis.count_u * b)] * traction.force;
        }
      }
    }
  }
  for (std::size_t f = 0; f < result.scene.forces.size(); ++f) {
    const SceneForce& load = result.scene.forces[f];
    const int k = result.panel(load.panel);
    const BuiltPanel& panel = result.panels[static_cast<std::size_t>(k)];
    const NurbsSurface& rest = result.rest(k);
    const Eigen::Vector2d uv = point_uv(load.at, rest);
    if (!in_material(panel.face, panel.topology, uv)) {
      throw GeometryError(fmt::format("{}: force {} ({}) is not on the material of panel '{}'", load.where, f,
                                      load.at.text, panel.name));
    }
    const ScalarRow row = result.model->place(k, uv.x(), uv.y());
    for (std::size_t i = 0; i < row.index.size(); ++i)
      loads.force.segment<3>(3 * row.index[i]) += row.value[i] * load.force;
  }
  result.seams = build_seams(result, result.warnings);
  if (touches(result.scene)) {
    result.obstacles = obstacles ? std::move(*obstacles) : obstacles_of(result);
    result.proxies = contact_proxies(result, result.warnings, result.notes);
    if (result.scene.contact.self) result.charts = sewn_charts(result);
  }
  for (const OutputPoint& point : result.scene.points) {
    const BuiltPanel& panel = result.panels[static_cast<std::size_t>(result.panel(point.panel))];
    if (!in_material(panel.face, panel.topology, point.uv)) {
      throw GeometryError(fmt::format("{}: output point ({}, {}) is not in the material of panel '{}'", point.where,
                                      point.uv.x(), point.uv.y(), panel.name));
    }
  }
  return result;
}

double longest_span(const Build& build) {
  double longest = 0;
  for (std::size_t k = 0; k < build.panels.size(); ++k) {
    const NurbsSurface& rest = build.rest(static_cast<int>(k));
    const std::vector<double> u = rest.u().breaks(), v = rest.v().breaks();
    for (std::size_t i = 0; i < u.size(); ++i) {
      for (std::size_t j = 0; j < v.size(); ++j) {
        const Eigen::Vector3d x = rest(u[i], v[j]);
        if (i + 1 < u.size()) longest = std::max(longest, (rest(u[i + 1], v[j]) - x).norm());
        if (j + 1 < v.size()) longest = std::max(longest, (rest(u[i], v[j + 1]) - x).norm());
      }
    }
  }
  return longest;
}

}  // namespace toile
