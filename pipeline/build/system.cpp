// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/build/system.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "analysis/constraint/row_areas.h"
#include "analysis/constraint/select_rows.h"
#include "analysis/projection/fast_projection.h"
#include "analysis/projection/lagrange_newton.h"
#include "analysis/projection/primal_dual.h"
#include "analysis/projection/substeps.h"
#include "geometry/error.h"
#include "pipeline/build/contact.h"
#include "pipeline/build/independent_rows.h"
#include "pipeline/build/pin_reach.h"
#include "pipeline/build/places.h"

namespace toile {
namespace {

// Starting threads takes some microseconds: with fewer points a step by one is as fast.
constexpr int least_control_points_for_threads = 2000;
constexpr double rest_residual = 1e-7;  // of the loads

// What is held on one side of a seam is held on the other.
std::vector<int> on_both_sides(const std::vector<int>& control_points, const std::vector<int>& leader) {
  std::vector<bool> held(leader.size(), false);
  for (const int i : control_points) held[static_cast<std::size_t>(leader[static_cast<std::size_t>(i)])] = true;
  std::vector<int> result;
  for (std::size_t k = 0; k < leader.size(); ++k) {
    if (held[static_cast<std::size_t>(leader[k])]) result.push_back(static_cast<int>(k));
  }
  return result;
}

// A point that others hold already adds nothing, so it is left out: a warning, unless one of them moves.
std::string held_twice(const Scene& scene, const std::vector<Candidate>& candidates,
                       const std::vector<Eigen::Vector3d>& taken, std::size_t k, const Eigen::VectorXd& start) {
  const ScenePin& pin = scene.pins[static_cast<std::size_t>(candidates[k].pin)];
  const Eigen::Vector3d at = apply(candidates[k].row, start);
  const ScenePin* other = nullptr;  // of the nearest place
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t l = 0; l < candidates.size(); ++l) {
    const double distance = (apply(candidates[l].row, start) - at).norm();
    if (taken[l].isZero() || candidates[l].seam >= 0 || candidates[l].pin == candidates[k].pin || !(distance < nearest))
      continue;
    nearest = distance;
    other = &scene.pins[static_cast<std::size_t>(candidates[l].pin)];
  }
  const std::string what =
      other ? fmt::format("{}: pin {} and pin {} ({}), {:.3g} m away, hold the same control points", pin.where,
                          pin.at.text, other->at.text, other->where, nearest)
            : fmt::format("{}: the control points of pin {} are held by other pins already", pin.where, pin.at.text);
  if (pin.move || (other && other->move))
    throw InputError(what +
                     ", and one of them moves; take one of them out, or make the cells smaller (refine), so that each "
                     "holds control points of its own");
  return what + fmt::format("; pin {} is left out", pin.at.text);
}

// A clamped edge of which some components are held: the control points beside it are held in the same ones. Where that
// is a single one, the edge lies in a plane of symmetry normal to it: the cloth goes on across it as it did at the
// start.
void hold_across(const std::vector<std::array<int, 2>>& across, const Eigen::Vector3d& hold, int first, int pin,
                 std::vector<Candidate>& candidates) {
  const bool symmetric = hold.sum() == 1;
  for (const auto& [edge, next] : across) {
    candidates.push_back({{{first + edge}, {1.0}}, pin, true, hold});
    if (!symmetric) {
      candidates.push_back({{{first + next}, {1.0}}, pin, true, hold});
      continue;
    }
    const double side = edge < next ? 1 : -1;
    candidates.push_back({{{first + std::min(edge, next), first + std::max(edge, next)}, {-side, side}},
                          pin,
                          true,
                          Eigen::Vector3d::Ones() - hold,
                          true});
  }
}

// What holds pins by component is PrimalDual.
void require_solver_of_components(const Scene& scene) {
  const StrainLimit& limit = scene.strain_limit;
  if (!limit.on || has_law(limit.solver)) return;
  for (std::size_t p = 0; p < scene.pins.size(); ++p) {
    const ScenePin& pin = scene.pins[p];
    if (!pin.partial()) continue;
    throw InputError(
        fmt::format("{}: pin {} ({}): hold leaves components free, which strain_limit.{} can't; leave that key out",
                    pin.where, p, pin.at.text, setting_of(limit.solver)));
  }
}

PrimalDualOptions limit_options(const StrainLimit& limit) {
  return {.weft = limit.weft, .warp = limit.warp, .tolerance = limit.tolerance, .max_iterations = limit.max_iterations};
}

std::vector<TensorNet> nets_of(const Build& build) {
  std::vector<TensorNet> nets;
  for (std::size_t k = 0; k < build.panels.size(); ++k) {
    const NurbsSurface& net = build.panels[k].face.surface;
    nets.push_back({build.model->first_point(static_cast<int>(k)), net.count_u(), net.count_v()});
  }
  return nets;
}

// `partial`: some places are held in part of their components.
std::unique_ptr<ConstraintSolver> constraint_solver(const Build& build, bool partial, const AffineMap& map,
                                                    const Eigen::VectorXd& node_mass, ConstraintRows rows) {
  const StrainLimit& limit = build.scene.strain_limit;
  const ProjectionOptions options{
      .tolerance = limit.tolerance, .regularisation = limit.regularisation, .max_iterations = limit.max_iterations};
  const LimitSolver of_pins = partial ? LimitSolver::newton : LimitSolver::paper;
  switch (limit.on ? limit.solver : of_pins) {
    case LimitSolver::newton:
      return std::make_unique<PrimalDual>(map, node_mass, std::move(rows), limit_options(limit));
    case LimitSolver::substeps:
      return std::make_unique<Substeps>(map, node_mass, std::move(rows),
                                        SubstepsOptions{.weft = limit.weft,
                                                        .warp = limit.warp,
                                                        .tolerance = limit.tolerance,
                                                        .percentile = limit.percentile,
                                                        .nets = nets_of(build)});
    case LimitSolver::paper:
      return std::make_unique<FastProjection>(map, node_mass, std::move(rows), options);
    case LimitSolver::lagrange:
      return std::make_unique<LagrangeNewton>(map, node_mass, std::move(rows), options);
  }
  return nullptr;
}

}  // namespace

double extent(const ClothPanel& panel) {
  Eigen::Matrix3Xd places(3, panel.quadrature.points.size());
  for (Eigen::Index k = 0; k < places.cols(); ++k) {
    const Eigen::Vector2d& uv = panel.quadrature.points[static_cast<std::size_t>(k)];
    places.col(k) = panel.rest(uv.x(), uv.y());
  }
  const Eigen::Vector3d middle = places.rowwise().mean();
  return std::numbers::sqrt2 * (places.colwise() - middle).colwise().norm().maxCoeff();
}

double limit_stiffness(const Build& build, int panel) {
  return build.scene.strain_limit.stiffness.value_or(default_limit_stiffness(build, panel));
}

double default_limit_stiffness(const Build& build, int panel) {
  const Scene& scene = build.scene;
  const StrainLimit& limit = scene.strain_limit;
  // Substeps have no wall that takes over where loads gather.
  const double reserve = 10, share = limit.solver == LimitSolver::substeps ? 100 : 10;
  const ClothPanel& cloth = build.model->panels()[static_cast<std::size_t>(panel)];
  double load = cloth.fabric.density * scene.gravity.norm() * extent(cloth);
  for (const SceneTraction& traction : scene.tractions) load = std::max(load, traction.force.norm());
  const double narrowest = std::min({limit.weft.stretch, limit.weft.compress, limit.warp.stretch, limit.warp.compress});
  const double own = std::max(cloth.fabric.membrane.weft, cloth.fabric.membrane.warp);
  return std::max({share * load / narrowest, reserve * own, reserve * cloth.fabric.density});
}

StepReport step(const System& system, DynamicState& state, double dt, StepWork& work) {
  return system.implicit ? system.implicit->step(state, dt, work) : step(system.dynamic, state, dt, work);
}

std::unique_ptr<System> assemble(const Build& build, double t, Workers* workers, const Sewing* sewing) {
  const Scene& scene = build.scene;
  require_solver_of_components(scene);
  auto system = std::make_unique<System>();
  *system->sewing = sewing ? *sewing : open_seams(scene, build.seams, build.start);
  const bool pulled = system->sewing->stage == Sewing::springs;
  if (!system->sewing->done() && scene.rest && scene.rest->method == RestMethod::newton)
    throw InputError(fmt::format(
        "{}: seams are open at the start, and solver.rest.method = \"newton\" has no time to close them; use "
        "\"relaxation\", or start from a drape whose seams are closed",
        scene.path.string()));

  // What each pin holds.
  struct Held {
    int control_point;
    int pin;
  };
  std::vector<Held> held;
  std::vector<Candidate> candidates;
  std::vector<PlaceRow> along_curves;
  std::vector<Eigen::Vector3d> mean(scene.pins.size(), Eigen::Vector3d::Zero());
  for (std::size_t p = 0; p < scene.pins.size(); ++p) {
    const ScenePin& pin = scene.pins[p];
    if (pin.release && *pin.release <= t) continue;
    const int k = build.panel(pin.panel);
    const BuiltPanel& panel = build.panels[static_cast<std::size_t>(k)];
    const Eigen::Matrix3Xd start = build.net(k, build.start);
    const std::string who = fmt::format("{}: pin {} ({})", pin.where, p, pin.at.text);
    const PanelPlaces places{panel.name, panel.face, panel.topology, build.rest(k), start, panel.carries_cloth};
    const HeldPlace place = held_place(pin.at, pin.clamp, places, who);
    const int first = build.model->first_point(k);
    if (pin.partial() && pin.clamp && place.across.empty())
      throw InputError(
          who +
          ": clamp = true with a hold that leaves components free works at whole edges only (edge:u0, or a "
          "curve that covers one); address an edge, leave clamp out, or leave hold out");
    int points = 0;
    const auto count = [&](int i) {
      mean[p] += start.col(i);
      ++points;
    };
    std::vector<int> followers;
    if (pin.partial() && pin.clamp) {
      hold_across(place.across, pin.hold, first, static_cast<int>(p), candidates);
      for (const auto& [edge, next] : place.across) count(edge);
    }
    for (const int i : on_both_sides(place.control_points, panel.leader)) {
      if (pin.partial() && pin.clamp) break;
      const bool leads = panel.leader[static_cast<std::size_t>(i)] == i;
      if (pin.partial()) {
        if (!leads) continue;
        candidates.push_back({{{first + i}, {1.0}}, static_cast<int>(p), true, pin.hold});
        count(i);
        continue;
      }
      if (panel.smooth_seams.follows(build.rest(k), i)) {
        if (leads) followers.push_back(i);
        continue;
      }
      held.push_back({first + i, static_cast<int>(p)});
      if (leads) count(i);  // a seam's place counts once
    }
    // Fixed by itself a point of a smooth seam would no longer follow its neighbours, and the seam could fold there.
    for (const int i : followers) {
      candidates.push_back({{{first + i}, {1.0}}, static_cast<int>(p), true});
    }
    if (points == 0) std::ranges::for_each(followers, count);
    for (std::size_t i = 0; i < place.points.size(); ++i) {
      const Eigen::Vector2d& uv = place.points[i];
      candidates.push_back({build.model->place(k, uv.x(), uv.y()), static_cast<int>(p), i < place.required, pin.hold});
      mean[p] += apply(candidates.back().row, build.start);
      ++points;
    }
    mean[p] /= points;
    for (const Eigen::Vector2d& uv : place.curve)
      along_curves.push_back({build.model->place(k, uv.x(), uv.y()), static_cast<int>(p), {}, pin.hold});
  }
  std::ranges::stable_sort(held, {}, &Held::control_point);
  std::vector<Held> fixed;
  for (const Held& h : held) {
    if (!fixed.empty() && fixed.back().control_point == h.control_point) {
      const ScenePin& a = scene.pins[static_cast<std::size_t>(fixed.back().pin)];
      const ScenePin& b = scene.pins[static_cast<std::size_t>(h.pin)];
      if (a.move || b.move) {
        throw InputError(
            fmt::format("{}: pins {} ({}, {}) and {} ({}) hold the same control point, and one of them moves; take one "
                        "of them out, or address places that don't meet",
                        b.where, fixed.back().pin, a.at.text, a.where, h.pin, b.at.text));
      }
      continue;
    }
    fixed.push_back(h);
  }

  const MovedPoint moved = [&scene, mean](int pin, const Eigen::Vector3d& from, double time) -> Eigen::Vector3d {
    const auto& move = scene.pins[static_cast<std::size_t>(pin)].move;
    return move ? (*move)(from, mean[static_cast<std::size_t>(pin)], time) : from;
  };
  refuse_out_of_reach(build, t, moved);

  std::vector<int> control_points;
  std::vector<Eigen::Vector3d> places;
  for (const Held& h : fixed) {
    control_points.push_back(h.control_point);
    places.push_back(build.start.segment<3>(3 * h.control_point));
    system->fixed_pin.push_back(h.pin);
  }
  system->map = std::make_unique<AffineMap>(build.dependence, control_points,
                                            [moved, places, pins = system->fixed_pin](std::size_t i, double time) {
                                              return moved(pins[i], places[i], time);
                                            });

  MechanicalSystem& dynamic = system->dynamic;
  dynamic.body = build.model.get();
  dynamic.potentials = build.model->potentials();
  if (build.model->point_count() >= least_control_points_for_threads) dynamic.workers = workers;
  dynamic.map = system->map.get();
  dynamic.loads = build.loads;
  if (!system->sewing->done() && !scene.sewing.gravity)
    for (int i = 0; i < build.model->point_count(); ++i)
      dynamic.loads.force.segment<3>(3 * i) -= build.model->lumped_mass()[i] * scene.gravity;
  dynamic.node_mass = system->map->reduce_scalar(build.model->lumped_mass());
  dynamic.node_drag = system->map->reduce_scalar(build.model->lumped_drag());
  const auto& nodes = system->map->node_control_point();
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    double& mass = dynamic.node_mass[static_cast<Eigen::Index>(k)];
    mass = std::max(mass, build.mass_floor[nodes[k]]);
    double& drag = dynamic.node_drag[static_cast<Eigen::Index>(k)];
    drag = scene.rest ? 0 : std::max(drag, 0.0);
  }

  // After the pins: where they hold both sides of a seam, it holds nothing.
  for (std::size_t s = 0; s < build.seams.size() && !pulled; ++s) {
    const BuiltSeam& seam = build.seams[s];
    for (std::size_t k = 0; k < seam.rows.size(); ++k) {
      candidates.push_back({.row = seam.rows[k].row,
                            .pin = -1,
                            .required = k < seam.required,
                            .seam = static_cast<int>(s),
                            .point = static_cast<int>(k)});
    }
  }
  const auto closing = [&build, clock = system->sewing](const ScalarRow& row, int seam) {
    const Eigen::VectorXd& from = clock->from.size() > 0 ? clock->from : build.start;
    return [gap = Eigen::Vector3d(apply(row, from)), clock, seam](double time) -> Eigen::Vector3d {
      return open_part(clock->progress_at(seam, time)) * gap;
    };
  };

  ConstraintRows rows;
  const std::vector<Eigen::Vector3d> taken = independent_axes(candidates, *system->map, dynamic.node_mass);
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    Candidate& c = candidates[k];
    if (c.seam >= 0) {
      if (taken[k].isZero()) continue;
      rows.place.push_back({c.row, -1, closing(c.row, c.seam), taken[k], c.seam});
      system->place_pin.push_back(-1);
      system->place_seam.push_back({c.seam, c.point});
      continue;
    }
    const Eigen::Vector3d from = apply(c.row, build.start);
    const bool point = scene.pins[static_cast<std::size_t>(c.pin)].at.kind == Address::Kind::uv;
    if (taken[k] != c.axes && point) system->warnings.push_back(held_twice(scene, candidates, taken, k, build.start));
    if (taken[k].isZero()) continue;
    const int pin = c.pin;
    rows.place.push_back({c.row, pin, {}, taken[k]});
    if (c.difference)
      rows.place.back().target = [from](double) { return from; };
    else
      rows.place.back().target = [moved, pin, from](double time) { return moved(pin, from, time); };
    system->place_pin.push_back(pin);
    system->place_seam.push_back({-1, -1});
  }
  if (pulled) {
    // Of a row: the inverse of the mass that moves with it [1/kg].
    const auto inertia = [&](const ScalarRow& row) {
      Eigen::VectorXd by_node = Eigen::VectorXd::Zero(dynamic.node_mass.size());
      for (std::size_t k = 0; k < row.index.size(); ++k)
        for (AffineMap::Matrix::InnerIterator it(system->map->free_part(), row.index[k]); it; ++it)
          by_node[it.col()] += row.value[k] * it.value();
      return std::max(by_node.cwiseAbs2().cwiseQuotient(dynamic.node_mass).sum(), 1e-300);
    };
    std::vector<SeamSpring> springs;
    for (const BuiltSeam& seam : build.seams)
      for (std::size_t k = 0; k < seam.rows.size(); ++k) {
        // Light nodes at trims would ask for smaller steps than the cloth does.
        const double stiffest = 1 / (spring_period * spring_period * inertia(seam.rows[k].row)) / seam.weight[k];
        springs.push_back({seam.rows[k].row, seam.weight[k], std::min(spring_stiffness, stiffest), 0});
      }
    system->springs = std::make_unique<SeamSprings>(std::move(springs), scene.sewing.force);
    set_sewing(*system, build, *system->sewing, build.start);
    dynamic.potentials.push_back(system->springs.get());
  }
  for (std::size_t s = 0; s < build.seams.size(); ++s)
    for (const SeamPlace& place : build.seams[s].along)
      system->along_seams.push_back(
          {place.row, -1, closing(place.row, static_cast<int>(s)), {1, 1, 1}, static_cast<int>(s)});
  for (PlaceRow& place : along_curves) {
    const Eigen::Vector3d from = apply(place.row, build.start);
    place.target = [moved, pin = place.pin, from](double time) { return moved(pin, from, time); };
  }
  system->along_curves = std::move(along_curves);
  for (const BuiltPanel& panel : build.panels) {
    system->points.push_back(panel.points);
    system->points.back().insert(system->points.back().end(), panel.extra_points.begin(), panel.extra_points.end());
  }
  const StrainLimit& limit = scene.strain_limit;
  if (limit.on) {
    std::vector<StrainRow> means;
    for (const BuiltPanel& panel : build.panels)
      means.insert(means.end(), panel.mean_rows.begin(), panel.mean_rows.end());
    rows.strain = select_rows(*build.model, *system->map, system->points, rows.place, means);
    if (means.empty()) system->unbalanced = unbalanced_part(*build.model, *system->map, rows.strain);
    if (!hard(limit.solver)) {
      std::vector<double> stiffness;
      for (std::size_t k = 0; k < build.panels.size(); ++k)
        stiffness.push_back(limit_stiffness(build, static_cast<int>(k)));
      for (StrainRow& row : rows.strain) row.stiffness = stiffness[static_cast<std::size_t>(row.panel)] * row.area;
    }
  }
  for (std::size_t k = 0; k < build.panels.size(); ++k) {
    const auto listed = static_cast<std::ptrdiff_t>(build.panels[k].points.size());
    system->extra_points.emplace_back(system->points[k].begin() + listed, system->points[k].end());
    system->points[k].resize(static_cast<std::size_t>(listed));
  }
  system->strain_rows = static_cast<int>(rows.strain.size());
  system->place_rows = static_cast<int>(rows.place.size());
  bool partial = false;
  for (const PlaceRow& row : rows.place) {
    system->place_components += static_cast<int>(row.axes.sum());
    partial = partial || row.axes != Eigen::Vector3d::Ones();
  }
  if (!rows.strain.empty() || !rows.place.empty()) {
    system->projection = constraint_solver(build, partial, *system->map, dynamic.node_mass, std::move(rows));
    system->projection->use_threads(dynamic.workers);
  }
  if (touches(scene)) {
    auto contact = with_contact(build, system->sewing->done(), *system->map, dynamic.node_mass, dynamic.node_drag,
                                std::move(system->projection));
    contact->use_threads(dynamic.workers);
    system->contact = contact.get();
    system->projection = std::move(contact);
  }
  dynamic.projection = system->projection.get();
  if (implicit(scene)) {
    const ImplicitRule rule = named_scheme(scene.scheme).rule.value_or(ImplicitRule::newmark);
    ImplicitOptions options;
    if (scene.rest) options.residual = rest_residual;
    system->implicit = std::make_unique<ImplicitScheme>(dynamic, limit_options(limit), rule, options);
  }
  if (scene.rest && scene.rest->load_steps) {
    if (dynamic.loads.force.isZero(0))
      throw InputError(
          scene.path.string() +
          ": load_steps in [solver] rest: the scene has no loads that could grow; give it gravity in [load], "
          "a [[traction]] or a [[force]], or leave load_steps out");
    system->path = std::make_unique<EquilibriumPath>(
        dynamic, PathOptions{.load_steps = *scene.rest->load_steps, .arc_length = scene.rest->arc_length});
  }
  return system;
}

double set_sewing(System& system, const Build& build, const Sewing& sewing, const Eigen::VectorXd& q) {
  *system.sewing = sewing;
  if (!system.springs) return 0;
  const double before = system.springs->energy(q);
  std::size_t spring = 0;
  for (std::size_t s = 0; s < build.seams.size(); ++s) {
    const double open = open_part(sewing.progress[s]);
    for (const SeamPlace& place : build.seams[s].rows)
      system.springs->set_slack(spring++, open * apply(place.row, build.start).norm());
  }
  return system.springs->energy(q) - before;
}

double pins_move(const System& system, double t, double dt, Eigen::Matrix3Xd& now, Eigen::Matrix3Xd& then) {
  system.map->fixed_places(t, now);
  system.map->fixed_places(t + dt, then);
  double most = 0;
  for (Eigen::Index k = 0; k < now.cols(); ++k) most = std::max(most, (then.col(k) - now.col(k)).norm());
  if (system.projection)
    for (const PlaceRow& row : system.projection->rows().place)
      most = std::max(most, (row.target(t + dt) - row.target(t)).norm());
  return most;
}

Eigen::VectorXd control_points(const System& system, const DynamicState& state) {
  Eigen::VectorXd q(3 * system.map->control_points());
  system.map->expand(state.x, state.t, q);
  return q;
}

Eigen::VectorXd control_point_velocity(const System& system, const DynamicState& state) {
  // q = T x + g(t): T v by expanding a step of x, g' by a central difference of the motion, which is smooth.
  constexpr double h = 1e-5;
  Eigen::VectorXd later(3 * system.map->control_points()), earlier(later.size());
  system.map->expand(state.v, state.t, later);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(state.v.size());
  system.map->expand(zero, state.t, earlier);
  Eigen::VectorXd velocity = later - earlier;
  system.map->expand(zero, state.t + h, later);
  system.map->expand(zero, state.t - h, earlier);
  velocity += (later - earlier) / (2 * h);
  return velocity;
}

DynamicState state_from(const System& system, const Eigen::VectorXd& q, const Eigen::VectorXd& v, double t) {
  DynamicState state;
  state.t = t;
  state.x = system.map->restrict(q);
  state.v = system.map->restrict(v);
  initialise(system.dynamic, state);
  return state;
}

}  // namespace toile
