// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/run/measures.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "analysis/constraint/stress_recovery.h"
#include "analysis/fabric/membrane_law.h"
#include "pipeline/build/places.h"

namespace toile {
namespace {

double percentile(const std::vector<double>& values, const std::vector<double>& weights, double fraction) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return values[k]; });
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  double below = 0;
  for (const std::size_t k : order) {
    below += weights[k];
    if (below >= fraction * total) return values[k];
  }
  return values.empty() ? 0 : values[order.back()];
}

// Of one direction, c.
void extremes(const std::vector<double>& x, const std::vector<double>& weights, int c, Extremes& e) {
  if (x.empty()) return;
  double total = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    total += weights[k];
    e.mean[c] += weights[k] * x[k];
    e.mean_abs[c] += weights[k] * std::abs(x[k]);
  }
  e.mean[c] /= total;
  e.mean_abs[c] /= total;
  e.min[c] = *std::ranges::min_element(x);
  e.max[c] = *std::ranges::max_element(x);
  e.p001[c] = percentile(x, weights, 0.001);
  e.p999[c] = percentile(x, weights, 0.999);
}

Extremes extremes(const std::vector<Eigen::Vector2d>& values, const std::vector<GridSample>& samples) {
  Extremes e;
  std::vector<double> weights, x(values.size());
  for (const GridSample& s : samples) weights.push_back(s.weight);
  for (int c = 0; c < 2; ++c) {
    std::ranges::transform(values, x.begin(), [c](const Eigen::Vector2d& value) { return value[c]; });
    extremes(x, weights, c, e);
  }
  return e;
}

ShearExtremes shear_extremes(const std::vector<double>& values, const std::vector<GridSample>& samples) {
  if (values.empty()) return {};
  const auto [least, most] = std::ranges::minmax(values);
  double area = 0, sum = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    area += samples[k].weight;
    sum += samples[k].weight * std::abs(values[k]);
  }
  return {least, most, sum / area};
}

// What eq. 37 gives at the rows themselves.
void measure_rows(const ConstraintRows& rows, const std::vector<ThreadStress>& stress, StateMeasures& m) {
  std::vector<double> nominal[2], second_pk[2], weights[2];
  for (std::size_t r = 0; r < stress.size(); ++r) {
    const int c = rows.strain[r].warp ? 1 : 0;
    nominal[c].push_back(stress[r].nominal);
    second_pk[c].push_back(stress[r].second_pk);
    weights[c].push_back(rows.strain[r].area);
  }
  for (int c = 0; c < 2; ++c) {
    extremes(nominal[c], weights[c], c, m.raw_nominal);
    extremes(second_pk[c], weights[c], c, m.raw_second_pk);
  }
}

// Strains that the limit holds, at its rows.
void measure_limit(const ConstraintRows& rows, const Eigen::VectorXd& q, StateMeasures& m) {
  for (const StrainRow& row : rows.strain) {
    const double strain = 0.5 * (apply(row.row, q).squaredNorm() - 1);
    const int c = row.warp ? 1 : 0;
    m.at_constraints_max = std::max(m.at_constraints_max, std::abs(strain));
    m.at_constraints.min[c] = std::min(m.at_constraints.min[c], strain);
    m.at_constraints.max[c] = std::max(m.at_constraints.max[c], strain);
  }
}

// Energy of the fabric's weft and warp strain over the cloth less that of the strains that the rows see: what hourglass
// modes hold. Where weft and warp are coupled each row counts half of what both hold together, its own strain against
// the other at its place. Negative where the rows count more than there is.
double unseen_energy(const Build& build, const System& system, const Eigen::VectorXd& q) {
  const Model& model = *build.model;
  double energy = 0;
  for (std::size_t k = 0; k < model.panels().size(); ++k) {
    const ClothPanel& panel = model.panels()[k];
    for (std::size_t p = 0; p < panel.quadrature.points.size(); ++p) {
      const Eigen::Vector2d& uv = panel.quadrature.points[p];
      const SurfaceJet jet = evaluate(panel.rest, uv.x(), uv.y());
      const MaterialState at = model.state(static_cast<int>(k), uv.x(), uv.y(), q);
      energy += 0.5 * panel.quadrature.weights[p] * jet.area_scale() * at.second_pk.head<2>().dot(at.strain.head<2>());
    }
  }
  for (const StrainRow& row : system.projection->rows().strain) {
    const Fabric& fabric = model.panels()[static_cast<std::size_t>(row.panel)].fabric;
    const double seen = 0.5 * (apply(row.row, q).squaredNorm() - 1);
    const Eigen::Vector3d there = model.state(row.panel, row.uv.x(), row.uv.y(), q).strain;
    const double along = row.warp ? membrane_stress(fabric.membrane, there[0], seen, 0.0).S22
                                  : membrane_stress(fabric.membrane, seen, there[1], 0.0).S11;
    energy -= 0.5 * along * row.area * seen;
  }
  return energy;
}

}  // namespace

Eigen::VectorXd row_forces(const System& system, const Eigen::VectorXd& q, double dt) {
  const std::vector<StrainRow>& rows = system.projection->rows().strain;
  const Eigen::Matrix3Xd& impulses = system.projection->memory().strain_impulses;
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(rows.size()));
  for (Eigen::Index r = 0; dt > 0 && r < forces.size(); ++r) {
    const Eigen::Vector3d impulse = impulses.col(r);
    const Eigen::Vector3d tangent = apply(rows[static_cast<std::size_t>(r)].row, q);
    forces[r] = std::copysign(impulse.norm(), impulse.dot(tangent)) / (dt * dt);
  }
  return forces;
}

StressField stress_field(const Build& build, const System& system, const Eigen::VectorXd& q, double dt) {
  ConstraintRows rows = system.projection->rows();
  // A pin along a curve stands for whatever line load its curve may carry.
  rows.place.insert(rows.place.end(), system.along_curves.begin(), system.along_curves.end());
  rows.place.insert(rows.place.end(), system.along_seams.begin(), system.along_seams.end());
  Eigen::Matrix3Xd forces = Eigen::Matrix3Xd::Zero(3, system.strain_rows);
  if (dt > 0) forces = system.projection->memory().strain_impulses / (dt * dt);
  return StressField(*build.model, *system.map, rows, forces, q);
}

Eigen::Vector3d up(const Scene& scene) {
  const double g = scene.gravity.norm();
  return g > 0 ? Eigen::Vector3d(-scene.gravity / g) : Eigen::Vector3d::UnitZ();
}

std::vector<GridSample> grid_samples(const Build& build, int n) {
  std::vector<GridSample> samples;
  for (std::size_t k = 0; k < build.panels.size(); ++k) {
    const BuiltPanel& panel = build.panels[k];
    const NurbsSurface& rest = build.rest(static_cast<int>(k));
    const Interval u = rest.u().domain(), v = rest.v().domain();
    const double cell = u.length() / n * (v.length() / n);
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const Eigen::Vector2d uv(u.min + u.length() * (i + 0.5) / n, v.min + v.length() * (j + 0.5) / n);
        if (!contains(panel.face, panel.topology, uv)) continue;
        const SurfaceJet jet = evaluate(rest, uv.x(), uv.y());
        samples.push_back({static_cast<int>(k), uv, cell * jet.area_scale()});
      }
    }
  }
  return samples;
}

std::vector<GridSample> border_samples(const Build& build) {
  std::vector<GridSample> samples;
  for (std::size_t k = 0; k < build.panels.size(); ++k) {
    const BuiltPanel& panel = build.panels[k];
    for (std::size_t l = 0; l < panel.face.loops.size(); ++l)
      for (std::size_t c = 0; c < panel.face.loops[l].curves.size(); ++c) {
        const CurveOnSurface curve(panel.face, panel.topology, static_cast<int>(l), static_cast<int>(c),
                                   build.rest(static_cast<int>(k)));
        const std::vector<double> t = curve.breaks(0, 1);
        for (std::size_t i = 1; i < t.size(); ++i)
          for (const double at : {t[i - 1], (t[i - 1] + t[i]) / 2})
            samples.push_back({static_cast<int>(k), curve.uv(at), 0});
      }
  }
  return samples;
}

std::vector<Eigen::Vector3d> output_points(const Build& build, const Eigen::VectorXd& q) {
  std::vector<Eigen::Vector3d> points;
  for (const OutputPoint& point : build.scene.points)
    points.push_back(build.model->state(build.panel(point.panel), point.uv.x(), point.uv.y(), q).position);
  return points;
}

std::vector<Eigen::Vector3d> pin_reactions(const Build& build, const System& system, const DynamicState& state,
                                           double dt) {
  std::vector<Eigen::Vector3d> out(build.scene.pins.size(), Eigen::Vector3d::Zero());
  if (!(dt > 0)) return out;
  const Reactions r = reactions(system.dynamic, state, dt);
  for (std::size_t k = 0; k < system.fixed_pin.size(); ++k)
    out[static_cast<std::size_t>(system.fixed_pin[k])] += r.fixed.col(static_cast<Eigen::Index>(k));
  for (std::size_t k = 0; k < system.place_pin.size(); ++k)
    if (system.place_pin[k] >= 0)
      out[static_cast<std::size_t>(system.place_pin[k])] += r.place.col(static_cast<Eigen::Index>(k));
  return out;
}

std::vector<SeamMeasures> seam_forces(const Build& build, const System& system, const DynamicState& state, double dt) {
  std::vector<SeamMeasures> out(build.seams.size());
  if (out.empty() || !(dt > 0)) return out;
  if (system.springs) {
    std::size_t spring = 0;
    for (std::size_t s = 0; s < build.seams.size(); ++s)
      for (std::size_t k = 0; k < build.seams[s].rows.size(); ++k, ++spring) {
        const double force = system.springs->force(state.q, spring);
        out[s].force = std::max(out[s].force, force);
        out[s].mean_force +=
            force * build.seams[s].weight[k] / (0.5 * (build.seams[s].length_a + build.seams[s].length_b));
      }
    return out;
  }
  const Reactions r = reactions(system.dynamic, state, dt);
  for (std::size_t k = 0; k < system.place_seam.size(); ++k) {
    const auto [seam, row] = system.place_seam[k];
    if (seam < 0) continue;
    const BuiltSeam& built = build.seams[static_cast<std::size_t>(seam)];
    const double force = r.place.col(static_cast<Eigen::Index>(k)).norm();
    SeamMeasures& m = out[static_cast<std::size_t>(seam)];
    m.force = std::max(m.force, force / built.weight[static_cast<std::size_t>(row)]);
    m.mean_force += force / (0.5 * (built.length_a + built.length_b));
  }
  return out;
}

namespace {

constexpr int points_per_cell = 7;    // each way, borders included
constexpr double within_reach = 0.1;  // m: beyond it a distance isn't looked for

ContactMeasures measure_contact(const Build& build, const System& system, const Eigen::VectorXd& q, double t,
                                double dt) {
  ContactMeasures m;
  for (const auto& obstacle : build.obstacles) obstacle->move(t, t);
  m.distance = std::numeric_limits<double>::infinity();
  double worst = 0;  // over what is allowed
  for (std::size_t k = 0; k < build.panels.size(); ++k) {
    const BuiltPanel& panel = build.panels[k];
    const KnotMesh& mesh = panel.topology.mesh;
    const double thickness = build.model->panels()[k].fabric.thickness;
    for (int j = 0; j < mesh.cells_v(); ++j)
      for (int i = 0; i < mesh.cells_u(); ++i) {
        const CellKind kind = panel.topology.cells[static_cast<std::size_t>(mesh.cell(i, j))];
        if (kind == CellKind::outside) continue;
        for (int b = 0; b < points_per_cell; ++b)
          for (int a = 0; a < points_per_cell; ++a) {
            const auto part = [](const std::vector<double>& lines, int cell, int n) {
              const double from = lines[static_cast<std::size_t>(cell)], to = lines[static_cast<std::size_t>(cell) + 1];
              return from + (to - from) * n / (points_per_cell - 1);
            };
            const Eigen::Vector2d uv(part(mesh.u, i, a), part(mesh.v, j, b));
            if (kind == CellKind::cut && !contains(panel.face, panel.topology, uv)) continue;
            const Eigen::Vector3d at = apply(build.model->place(static_cast<int>(k), uv.x(), uv.y()), q);
            for (const auto& obstacle : build.obstacles) {
              auto near = obstacle->nearest(at, within_reach);
              if (!near && obstacle->closed()) near = obstacle->nearest(at, HUGE_VAL);  // it may be deep inside
              if (!near || near->distance > within_reach) continue;
              const double distance = obstacle->closed() ? near->distance : std::abs(near->distance);
              m.distance = std::min(m.distance, distance);
              const double skin = thickness / 2 + obstacle->thickness(), depth = skin - distance,
                           allowed = 0.1 * (thickness + obstacle->thickness() + build.scene.contact.chord);
              if (!(depth > 0) || !(depth / allowed > worst)) continue;
              worst = depth / allowed;
              m.penetration = depth;
              m.allowed = allowed;
              m.where = fmt::format("panel '{}' at (u, v) = ({:.6g}, {:.6g}) and obstacle '{}'", panel.name, uv.x(),
                                    uv.y(), obstacle->name());
            }
          }
      }
  }
  for (std::size_t k = 0; k < build.obstacles.size(); ++k) {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    if (dt > 0) force = system.contact->memory().by_obstacle.col(static_cast<Eigen::Index>(k)) / (dt * dt);
    m.forces.push_back(force);
  }
  return m;
}

}  // namespace

StateMeasures measure(const Build& build, const System& system, const DynamicState& state, double dt) {
  StateMeasures m;
  const Model& model = *build.model;
  const Eigen::VectorXd q = control_points(system, state);
  const std::vector<GridSample> samples = grid_samples(build);
  std::vector<Eigen::Vector2d> strain, nominal, second_pk;
  std::vector<double> shear;
  std::optional<StressField> field;
  if (system.strain_rows > 0) {
    field.emplace(stress_field(build, system, q, dt));
    const ConstraintRows& rows = system.projection->rows();
    measure_rows(rows, row_stress(model, rows, row_forces(system, q, dt), q), m);
    m.unseen_energy = unseen_energy(build, system, q);
  }
  const auto add_stress = [&](const GridSample& s, const MaterialState& at) {
    if (field) {
      const auto [weft, warp] = field->at(s.panel, s.uv.x(), s.uv.y());
      second_pk.emplace_back(weft.second_pk, warp.second_pk);
      nominal.emplace_back(weft.nominal, warp.nominal);
    } else {
      nominal.push_back(at.nominal);
      second_pk.emplace_back(at.second_pk.head<2>());
    }
  };
  const Eigen::Vector3d axis = up(build.scene);
  m.lowest = std::numeric_limits<double>::max();
  m.highest = std::numeric_limits<double>::lowest();
  const auto reach = [&](const Eigen::Vector3d& x) {
    m.lowest = std::min(m.lowest, axis.dot(x));
    m.highest = std::max(m.highest, axis.dot(x));
  };
  for (const GridSample& s : samples) {
    const MaterialState at = model.state(s.panel, s.uv.x(), s.uv.y(), q);
    strain.emplace_back(at.strain.head<2>());
    shear.push_back(at.strain[2]);
    add_stress(s, at);
    reach(at.position);
    const Eigen::Vector3d start = model.state(s.panel, s.uv.x(), s.uv.y(), build.start).position;
    m.largest_deflection = std::max(m.largest_deflection, (at.position - start).norm());
  }
  m.strain = extremes(strain, samples);
  m.shear = shear_extremes(shear, samples);
  std::vector<GridSample> everywhere = samples;  // the border has no area: it counts for the least and the largest
  for (const GridSample& s : border_samples(build)) {
    add_stress(s, model.state(s.panel, s.uv.x(), s.uv.y(), q));
    everywhere.push_back(s);
  }
  m.nominal = extremes(nominal, everywhere);
  m.second_pk = extremes(second_pk, everywhere);

  for (std::size_t k = 0; k < build.panels.size(); ++k) {
    for (const ConstraintPoint& point : build.panels[k].points) {
      const MaterialState at = model.state(static_cast<int>(k), point.u, point.v, q);
      reach(at.position);
      if (system.strain_rows == 0) {
        m.at_constraints_max = std::max(m.at_constraints_max, at.strain.head<2>().cwiseAbs().maxCoeff());
      }
    }
  }
  if (system.projection) measure_limit(system.projection->rows(), q, m);
  for (const ClothPanel& panel : model.panels()) {
    for (std::size_t k = 0; k < panel.quadrature.points.size(); ++k) {
      const SurfaceJet jet = evaluate(panel.rest, panel.quadrature.points[k].x(), panel.quadrature.points[k].y());
      const double area = panel.quadrature.weights[k] * jet.area_scale();
      m.area += area;
      m.mass += area * panel.fabric.density;
    }
  }
  if (system.contact && !build.obstacles.empty()) m.contact = measure_contact(build, system, q, state.t, dt);
  m.points = output_points(build, q);
  m.reactions = pin_reactions(build, system, state, dt);
  m.seams = seam_forces(build, system, state, dt);
  for (const PlaceRow& place : system.along_seams) {
    double& gap = m.seams[static_cast<std::size_t>(place.seam)].gap;
    gap = std::max(gap, apply(place.row, q).norm());
  }
  m.gaps.resize(build.scene.pins.size());
  for (const PlaceRow& place : system.along_curves) {
    std::optional<double>& gap = m.gaps[static_cast<std::size_t>(place.pin)];
    gap = std::max(gap.value_or(0), (apply(place.row, q) - place.target(state.t)).cwiseProduct(place.axes).norm());
  }
  return m;
}

}  // namespace toile
