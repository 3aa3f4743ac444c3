// SPDX-License-Identifier: GPL-3.0-or-later
// The shell obstacle course on exact surfaces: parts of it cut off by planes of symmetry. [Belytschko et al. 1985;
// MacNeal & Harder 1985]
#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "analysis/projection/primal_dual.h"
#include "analysis/scheme/implicit.h"
#include "analysis/shell/shell_model.h"
#include "geometry/refine.h"
#include "support/panels.h"

namespace toile::test {

inline constexpr double right_angle = std::numbers::pi / 2, one_degree = std::numbers::pi / 180;

// Isotropic, of 1 kg/m2: Pa, 1, m.
inline Fabric shell(double youngs_modulus, double poissons_ratio, double thickness) {
  Fabric fabric = isotropic(youngs_modulus, poissons_ratio, thickness);
  fabric.density = 1;
  return fabric;
}

// Rational quadratic arc about the origin from angle a, a turn of `angle` < pi: columns of (w cos, w sin, w).
inline Eigen::Matrix3d arc(double radius, double a, double angle) {
  const double w = std::cos(angle / 2), b = a + angle / 2;
  Eigen::Matrix3d out;
  out << radius * std::cos(a), radius * std::cos(b), radius * std::cos(a + angle),  //
      radius * std::sin(a), radius * std::sin(b), radius * std::sin(a + angle),     //
      1, w, 1;
  return out;
}

// The same surface with `degree` and spans of one length in both directions.
inline NurbsSurface refined(const NurbsSurface& surface, int degree, int spans_u, int spans_v) {
  NurbsSurface out = elevate_degree(elevate_degree(surface, Direction::u, degree), Direction::v, degree);
  for (const Direction d : {Direction::u, Direction::v}) {
    const int spans = d == Direction::u ? spans_u : spans_v;
    const Interval domain = out.knots(d).domain();
    std::vector<double> knots;
    for (int k = 1; k < spans; ++k) knots.push_back(domain.min + domain.length() * k / spans);
    out = insert_knots(out, d, knots);
  }
  return out;
}

// u runs along the arc from the crown (0, 0, radius) towards x, v along y from 0.
inline NurbsSurface cylinder_part(double radius, double angle, double length) {
  const Eigen::Matrix3d c = arc(radius, 0, angle);
  Eigen::Matrix3Xd points(3, 6);
  std::vector<double> weights;
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 3; ++i) {
      points.col(i + 3 * j) << c(1, i) / c(2, i), j * length, c(0, i) / c(2, i);
      weights.push_back(c(2, i));
    }
  return {uniform_knots(2, 1), uniform_knots(1, 1), points, weights};
}

// u: longitude from the x axis to the y axis, v: latitude from the equator.
inline NurbsSurface sphere_part(double radius, double latitude) {
  const Eigen::Matrix3d around = arc(1, 0, std::numbers::pi / 2), up = arc(radius, 0, latitude);
  Eigen::Matrix3Xd points(3, 9);
  std::vector<double> weights;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) {
      points.col(i + 3 * j) << around(0, i) / around(2, i) * up(0, j) / up(2, j),
          around(1, i) / around(2, i) * up(0, j) / up(2, j), up(1, j) / up(2, j);
      weights.push_back(around(2, i) * up(2, j));
    }
  return {uniform_knots(2, 1), uniform_knots(2, 1), points, weights};
}

// A shell of one panel under dead loads, held by component.
class ShellProblem {
 public:
  ShellProblem(NurbsSurface surface, const Fabric& fabric)
      : model_([&] {
          std::vector<ClothPanel> panels;
          panels.push_back(make_panel(std::move(surface), fabric));
          return panels;
        }()),
        dependence_(AffineMap::identity(model_.point_count())) {
    system_.loads.force = Eigen::VectorXd::Zero(3 * model_.point_count());
  }
  const NurbsSurface& rest() const { return model_.panels()[0].rest; }
  const ShellModel& model() const { return model_; }
  const MechanicalSystem& system() const { return system_; }

  // Control points of an edge, and of the row beside it: direction 0: u = const, end 0: min.
  int edge(int direction, int end, int k, int row = 0) const {
    const int across = direction == 0 ? rest().count_u() : rest().count_v();
    const int at = end == 0 ? row : across - 1 - row;
    return direction == 0 ? rest().index(at, k) : rest().index(k, at);
  }
  int along(int direction) const { return direction == 0 ? rest().count_v() : rest().count_u(); }
  void hold(int point, const Eigen::Vector3d& axes) {
    const Eigen::Vector3d place = rest().points().col(point);
    rows_.place.push_back({{{point}, {1.0}}, 0, [place](double) { return place; }, axes});
  }
  void hold_edge(int direction, int end, const Eigen::Vector3d& axes, int rows = 1) {
    for (int row = 0; row < rows; ++row)
      for (int k = 0; k < along(direction); ++k) hold(edge(direction, end, k, row), axes);
  }
  // An edge in a plane of symmetry with that normal, an axis: the row beside it lies along the normal.
  void mirror_edge(int direction, int end, int axis) {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    normal[axis] = 1;
    for (int k = 0; k < along(direction); ++k) {
      const int a = edge(direction, end, k), b = edge(direction, end, k, 1);
      hold(a, normal);
      const Eigen::Vector3d apart = rest().points().col(std::max(a, b)) - rest().points().col(std::min(a, b));
      if (apart.norm() < 1e-9) continue;  // a pole
      rows_.place.push_back({{{std::min(a, b), std::max(a, b)}, {-1.0, 1.0}},
                             0,
                             [apart](double) { return apart; },
                             Eigen::Vector3d::Ones() - normal});
    }
  }
  // All control points of an edge are one: a pole.
  void join_edge(int direction, int end) {
    const int leader = edge(direction, end, 0);
    for (int k = 1; k < along(direction); ++k) {
      const int i = edge(direction, end, k);
      dependence_.coeffRef(i, i) = 0;
      dependence_.coeffRef(i, leader) = 1;
    }
    dependence_.prune(0.0);
  }
  void pull(int point, const Eigen::Vector3d& force) { system_.loads.force.segment<3>(3 * point) += force; }
  void pull_area(const Eigen::Vector3d& force) {
    for (int i = 0; i < model_.point_count(); ++i)
      pull(i, model_.lumped_mass()[i] / model_.panels()[0].fabric.density * force);
  }

  // Once everything is held and loaded.
  void finish() {
    map_ = std::make_unique<AffineMap>(dependence_, std::vector<int>(), AffineMap::Motion());
    system_.body = &model_;
    system_.potentials = model_.potentials();
    system_.map = map_.get();
    system_.node_mass = map_->reduce_scalar(model_.lumped_mass());
    system_.node_drag = Eigen::VectorXd::Zero(map_->nodes());
    const PrimalDualOptions options;
    solver_ = std::make_unique<PrimalDual>(*map_, system_.node_mass, rows_, options);
    system_.projection = solver_.get();
    state.x = map_->restrict(model_.rest());
    state.v = Eigen::VectorXd::Zero(state.x.size());
    initialise(system_, state);
  }
  Eigen::Vector3d moved(double u, double v) const {
    Eigen::VectorXd q(3 * map_->control_points());
    map_->expand(state.x, state.t, q);
    return model_.state(0, u, v, q).position - model_.state(0, u, v, model_.rest()).position;
  }

  DynamicState state;

 private:
  ShellModel model_;
  AffineMap::Matrix dependence_;
  ConstraintRows rows_;
  std::unique_ptr<AffineMap> map_;
  std::unique_ptr<PrimalDual> solver_;
  MechanicalSystem system_;
};

}  // namespace toile::test
