// SPDX-License-Identifier: GPL-3.0-or-later
// A square of shell cloth with obstacles, for tests of contact.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "analysis/contact/contact_projection.h"
#include "analysis/contact/shapes.h"
#include "analysis/projection/primal_dual.h"
#include "analysis/projection/substeps.h"
#include "analysis/scheme/verlet.h"
#include "support/panels.h"
#include "trimming/cell_triangles.h"

namespace toile::test {

using Obstacles = std::vector<std::unique_ptr<Obstacle>>;

enum class Limit { none, law, substeps };

struct ContactSceneOptions {
  double size = 0.4;
  int degree = 2, spans = 8, divisions = 3;
  Fabric fabric = {};
  Limit limit = Limit::law;
  double stiffness = 500;                // N/m of the limit
  Eigen::Vector3d gravity{0, 0, -9.81};  // m/s2
  Eigen::Vector3d shift{0, 0, 0}, velocity{0, 0, 0};
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  std::vector<int> fixed = {};
  double half_thickness = 0.5e-3;
  ContactOptions contact = {};
};

// The panel lies in x and y from 0 to its size, turned about the origin, then shifted.
struct ContactScene {
  ContactSceneOptions options;
  Obstacles obstacles;
  ShellModel model;
  AffineMap map;
  std::unique_ptr<ContactProjection> contact;
  MechanicalSystem system;
  DynamicState state;
  StepWork work;
  StepReport last;

  ContactScene(const ContactSceneOptions& o, Obstacles all)
      : options(o),
        obstacles(std::move(all)),
        model([&] {
          std::vector<ClothPanel> panels;
          panels.push_back(make_flat_panel(o.size, o.size, o.degree, o.spans, o.spans, o.fabric));
          return panels;
        }()),
        map(AffineMap::identity(model.point_count()), o.fixed,
            [this](std::size_t k, double) { return placed(options.fixed[k]); }) {
    system.body = &model;
    system.potentials = model.potentials();
    system.map = &map;
    system.node_mass = map.reduce_scalar(model.lumped_mass());
    system.node_drag = map.reduce_scalar(model.lumped_drag());
    system.loads.force = weight_of(model, o.gravity);
    renew();
    Eigen::VectorXd q(3 * model.point_count());
    for (int i = 0; i < model.point_count(); ++i) q.segment<3>(3 * i) = placed(i);
    state.x = map.restrict(q);
    state.v = Eigen::VectorXd::Zero(state.x.size());
    for (int k = 0; k < map.nodes(); ++k) state.v.segment<3>(3 * k) = o.velocity;
    initialise(system, state);
  }

  Eigen::Vector3d placed(int i) const { return options.shift + options.turn * model.rest().segment<3>(3 * i); }

  // The constraints anew, as after a resume.
  void renew() {
    const NurbsSurface& rest = model.panels()[0].rest;
    std::unique_ptr<ConstraintSolver> inner;
    if (options.limit != Limit::none) {
      std::vector<std::vector<ConstraintPoint>> points(1);
      for (double v : rest.v().breaks())
        for (double u : rest.u().breaks()) {
          points[0].emplace_back();
          points[0].back().u = u, points[0].back().v = v;
        }
      ConstraintRows rows;
      rows.strain = strain_rows(model, map, points);
      for (StrainRow& row : rows.strain) row.stiffness = options.stiffness * row.area;
      if (options.limit == Limit::law)
        inner = std::make_unique<PrimalDual>(map, system.node_mass, std::move(rows));
      else
        inner = std::make_unique<Substeps>(map, system.node_mass, std::move(rows));
    }
    TrimmedSurface surface;
    surface.surface = rest;
    surface.loops.push_back(natural_loop(rest));
    std::vector<ProxyPanel> panels;
    panels.push_back({triangulate_cells(surface, trace_trims(surface), {options.divisions, options.divisions}),
                      options.half_thickness, options.fabric.friction});
    contact = std::make_unique<ContactProjection>(model, map, system.node_mass, system.node_drag, std::move(panels),
                                                  obstacles, std::move(inner), options.contact);
    system.projection = contact.get();
  }

  // False where a step found no balance.
  bool run(double dt, double until) {
    bool met = true;
    const int steps = static_cast<int>(std::lround((until - state.t) / dt));
    for (int k = 0; k < steps; ++k) {
      last = step(system, state, dt, work);
      if (!last.finite) {
        ADD_FAILURE() << "not finite at " << state.t;
        return false;
      }
      met = met && last.projection.converged;
    }
    return met;
  }

  // Of the material that is (x, y) [m] from the panel's corner.
  Eigen::Vector3d at(double x, double y) const {
    return apply(model.place(0, x / options.size, y / options.size), state.q);
  }
  // Where the cloth is over (x, y) [m] in space, looked for from the material that lay there.
  Eigen::Vector3d above(double x, double y) const {
    Eigen::Vector2d p(x - options.shift.x(), y - options.shift.y());
    const Eigen::Vector2d goal(x, y);
    constexpr double step = 1e-6;
    for (int k = 0; k < 30; ++k) {
      const Eigen::Vector2d here = at(p.x(), p.y()).head<2>();
      Eigen::Matrix2d slope;
      slope << (at(p.x() + step, p.y()).head<2>() - here) / step, (at(p.x(), p.y() + step).head<2>() - here) / step;
      p += 0.5 * slope.inverse() * (goal - here);
    }
    EXPECT_LT((at(p.x(), p.y()).head<2>() - goal).norm(), 1e-6);
    return at(p.x(), p.y());
  }
  Eigen::Vector3d mean() const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < model.point_count(); ++i) sum += model.lumped_mass()[i] * state.q.segment<3>(3 * i);
    return sum / model.lumped_mass().sum();
  }
  double weight() const { return model.lumped_mass().sum() * options.gravity.norm(); }
  // How far the cloth's middle surface is within half its thickness and the obstacle's, by 7 x 7 points a cell [m].
  double depth() const {
    double deepest = 0;
    const NurbsSurface& rest = model.panels()[0].rest;
    const auto grid = [](const KnotVector& knots) {
      std::vector<double> out;
      const std::vector<double> breaks = knots.breaks();
      for (std::size_t k = 0; k + 1 < breaks.size(); ++k)
        for (int s = 0; s < 7; ++s) out.push_back(breaks[k] + (breaks[k + 1] - breaks[k]) * s / 6);
      return out;
    };
    for (const double u : grid(rest.u()))
      for (const double v : grid(rest.v()))
        for (const auto& obstacle : obstacles) {
          const double skin = options.half_thickness + obstacle->thickness();
          const auto near = obstacle->nearest(apply(model.place(0, u, v), state.q), 1);
          if (near) deepest = std::max(deepest, skin - near->distance);
        }
    return deepest;
  }
  // Force of an obstacle on the cloth in the last step [N].
  Eigen::Vector3d force(int obstacle) const {
    return contact->memory().by_obstacle.col(obstacle) / (last.dt * last.dt);
  }
};

template <class Shape>
Obstacles one(const Shape& shape, double friction, double thickness = 0, RigidMotion motion = nullptr) {
  Obstacles all;
  all.push_back(make_obstacle(shape, {.name = "it", .friction = friction, .thickness = thickness}, std::move(motion)));
  return all;
}

}  // namespace toile::test
