#include "pipeline/measures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace toile {
namespace {

double percentile(const std::vector<double>& values, const std::vector<GridSample>& samples, double fraction) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return values[k]; });
  double total = 0;
  for (const GridSample& s : samples) total += s.weight;
  double below = 0;
  for (const std::size_t k : order) {
    below += samples[k].weight;
    if (below >= fraction * total) return values[k];
  }
  return values.empty() ? 0 : values[order.back()];
}

Extremes extremes(const std::vector<Eigen::Vector2d>& values, const std::vector<GridSample>& samples) {
  Extremes e;
  if (values.empty()) return e;
  for (int c = 0; c < 2; ++c) {
    std::vector<double> x(values.size());
    double total = 0;
    for (std::size_t k = 0; k < values.size(); ++k) {
      x[k] = values[k][c];
      const double w = samples[k].weight;
      total += w;
      e.mean[c] += w * x[k];
      e.mean_abs[c] += w * std::abs(x[k]);
    }
    e.mean[c] /= total;
    e.mean_abs[c] /= total;
    e.min[c] = *std::ranges::min_element(x);
    e.max[c] = *std::ranges::max_element(x);
    e.p999[c] = percentile(x, samples, 0.999);
  }
  return e;
}

}  // namespace

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
        samples.push_back({static_cast<int>(k), uv, cell * jet.u.cross(jet.v).norm()});
      }
    }
  }
  return samples;
}

StateMeasures measure(const Build& build, const System& system, const DynamicState& state, double dt) {
  StateMeasures m;
  const ShellModel& model = *build.model;
  const Eigen::VectorXd q = control_points(system, state);
  const std::vector<GridSample> samples = grid_samples(build);
  std::vector<Eigen::Vector2d> strain, nominal, second_pk;
  const Eigen::Vector3d axis = up(build.scene);
  m.lowest = std::numeric_limits<double>::max();
  m.highest = std::numeric_limits<double>::lowest();
  const auto reach = [&](const Eigen::Vector3d& x) {
    m.lowest = std::min(m.lowest, axis.dot(x));
    m.highest = std::max(m.highest, axis.dot(x));
  };
  for (const GridSample& s : samples) {
    const ShellState at = model.state(s.panel, s.uv.x(), s.uv.y(), q);
    strain.emplace_back(at.strain.head<2>());
    nominal.push_back(at.nominal);
    second_pk.emplace_back(at.second_pk.head<2>());
    reach(at.position);
    const Eigen::Vector3d start = model.state(s.panel, s.uv.x(), s.uv.y(), build.start).position;
    m.largest_deflection = std::max(m.largest_deflection, (at.position - start).norm());
  }
  m.strain = extremes(strain, samples);
  m.nominal = extremes(nominal, samples);
  m.second_pk = extremes(second_pk, samples);

  for (std::size_t k = 0; k < build.panels.size(); ++k) {
    for (const ConstraintPoint& point : build.panels[k].points) {
      const ShellState at = model.state(static_cast<int>(k), point.u, point.v, q);
      reach(at.position);
      if (system.strain_rows == 0) {
        m.at_constraints_max = std::max(m.at_constraints_max, at.strain.head<2>().cwiseAbs().maxCoeff());
      }
    }
  }
  if (system.projection) {
    for (const StrainRow& row : system.projection->rows().strain) {
      Eigen::Vector3d y = Eigen::Vector3d::Zero();
      for (std::size_t a = 0; a < row.row.index.size(); ++a) {
        y += row.row.value[a] * q.segment<3>(3 * row.row.index[a]);
      }
      m.at_constraints_max = std::max(m.at_constraints_max, std::abs(0.5 * (y.squaredNorm() - 1)));
    }
  }
  for (const ShellPanel& panel : model.panels()) {
    for (std::size_t k = 0; k < panel.quadrature.points.size(); ++k) {
      const SurfaceJet jet = evaluate(panel.rest, panel.quadrature.points[k].x(), panel.quadrature.points[k].y());
      const double area = panel.quadrature.weights[k] * jet.u.cross(jet.v).norm();
      m.area += area;
      m.mass += area * panel.fabric.density;
    }
  }
  for (const OutputPoint& point : build.scene.points) {
    m.points.push_back(model.state(build.panel(point.panel), point.uv.x(), point.uv.y(), q).position);
  }
  m.reactions.assign(build.scene.pins.size(), Eigen::Vector3d::Zero());
  if (dt > 0) {
    const Reactions r = reactions(system.dynamic, state, dt);
    for (std::size_t k = 0; k < system.fixed_pin.size(); ++k) {
      m.reactions[static_cast<std::size_t>(system.fixed_pin[k])] += r.fixed.col(static_cast<Eigen::Index>(k));
    }
    for (std::size_t k = 0; k < system.place_pin.size(); ++k) {
      m.reactions[static_cast<std::size_t>(system.place_pin[k])] += r.place.col(static_cast<Eigen::Index>(k));
    }
  }
  return m;
}

}  // namespace toile
