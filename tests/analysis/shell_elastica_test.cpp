// SPDX-License-Identifier: GPL-3.0-or-later
// A strip clamped level at one end bends under its own weight: the heavy elastica, with the linear bending law
// (kappa0 = 0), twist = b0 so that the strip resists torsion, and a membrane stiff enough to count as inextensible.
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <initializer_list>
#include <vector>

#include "analysis/shell/shell_model.h"
#include "support/near.h"
#include "support/panels.h"

namespace toile {
namespace {

struct Tip {
  double along = 0, drop = 0;  // over the length
};

// Shape of the inextensible rod theta'' = gamma (1 - s) cos(theta), theta(0) = 0, theta'(1) = 0, gamma = weight per
// length * L^3 / bending stiffness; theta counts downwards. Shooting on theta'(0) with classical Runge-Kutta steps.
Tip heavy_elastica(double gamma) {
  const auto shoot = [gamma](double start) {
    using State = std::array<double, 4>;  // theta, theta', along, drop
    const auto rate = [gamma](double s, const State& y) {
      return State{y[1], -gamma * (1 - s) * std::cos(y[0]), std::cos(y[0]), std::sin(y[0])};
    };
    const auto moved = [](const State& y, double h, const State& k) {
      return State{y[0] + h * k[0], y[1] + h * k[1], y[2] + h * k[2], y[3] + h * k[3]};
    };
    State y{0, start, 0, 0};
    const int steps = 4000;
    const double h = 1.0 / steps;
    for (int i = 0; i < steps; ++i) {
      const double s = i * h;
      const State k1 = rate(s, y), k2 = rate(s + h / 2, moved(y, h / 2, k1)), k3 = rate(s + h / 2, moved(y, h / 2, k2)),
                  k4 = rate(s + h, moved(y, h, k3));
      for (int c = 0; c < 4; ++c) y[c] += h / 6 * (k1[c] + 2 * k2[c] + 2 * k3[c] + k4[c]);
    }
    return y;
  };
  double low = 0, high = gamma;
  while (high - low > 1e-14 * gamma) (shoot((low + high) / 2)[1] > 0 ? high : low) = (low + high) / 2;
  const auto y = shoot((low + high) / 2);
  return {y[2], y[3]};
}

// Static equilibrium by Newton with the exact tangent, the weight applied in increments.
Tip shell_tip(int degree, int spans, double gamma, double membrane) {
  const double length = 1, width = 0.1, stiffness = 1;
  Fabric fabric;
  fabric.density = 1;
  fabric.membrane = {membrane, membrane, membrane / 2};
  fabric.bending = {.b0 = stiffness, .kappa0 = 0, .kappa_reg = 1, .twist = stiffness};
  const ShellModel model({test::make_flat_panel(length, width, degree, spans, 1, fabric)});
  const NurbsSurface& surface = model.panels()[0].rest;
  std::vector<int> free;  // all but the first two rows of control points: place and slope
  for (int k = 0; k < model.point_count(); ++k)
    if (k % surface.count_u() > 1)
      for (int c = 0; c < 3; ++c) free.push_back(3 * k + c);
  const int n = static_cast<int>(free.size());
  Eigen::VectorXd q = model.rest(), force(q.size()), dq(q.size()), column(q.size());
  Eigen::MatrixXd K(n, n);
  const int increments = 10;
  for (int increment = 1; increment <= increments; ++increment) {
    Eigen::VectorXd weight = Eigen::VectorXd::Zero(q.size());
    for (int k = 0; k < model.point_count(); ++k)
      weight[3 * k + 2] = -gamma * increment / increments * model.lumped_mass()[k];
    double residual = 1;
    for (int iteration = 0; iteration < 60 && residual > 1e-6; ++iteration) {
      for (int j = 0; j < n; ++j) {
        dq.setZero();
        dq[free[j]] = 1;
        model.apply_tangent(q, dq, column, TangentKind::exact);
        K.col(j) = column(free);
      }
      model.internal_force(q, force);
      const Eigen::VectorXd r = (force + weight)(free);
      residual = r.norm() / weight(free).norm();
      q(free) += K.partialPivLu().solve(r);
    }
    EXPECT_LE(residual, 1e-6) << "degree " << degree << ", spans " << spans << ", increment " << increment;
  }
  const Eigen::Vector3d tip = model.state(0, 1, 0.5, q).position;
  return {tip[0] / length, -tip[2] / length};
}

double distance(const Tip& a, const Tip& b) {
  return std::hypot(a.along - b.along, a.drop - b.drop);
}

TEST(HeavyElastica, ReferenceSolvesTheRod) {
  // Small weights: the beam's tip drops by gamma / 8.
  expect_near_rel(heavy_elastica(1e-3).drop, 1e-3 / 8, 1e-6);
  // Values of an independent solver.
  expect_near_rel(heavy_elastica(10).along, 0.6563537612, 1e-9);
  expect_near_rel(heavy_elastica(10).drop, 0.7001997155, 1e-9);
  expect_near_rel(heavy_elastica(1).along, 0.9912463953, 1e-9);
  expect_near_rel(heavy_elastica(1).drop, 0.1234714020, 1e-9);
}

class ShellElastica : public ::testing::TestWithParam<double> {};

// The membrane is so stiff that the weight stretches it by 1e-4 of its length at most; errors stay well above what that
// moves the tip. Coarse quadratic strips lock (the membrane resists bending into arcs), which shows as an order
// above 2.
TEST_P(ShellElastica, TipConvergesWithSecondOrderToWithinOnePercent) {
  const double gamma = GetParam(), membrane = 1e4 * gamma;
  const Tip exact = heavy_elastica(gamma);
  const auto errors = [&](int degree, std::initializer_list<int> levels) {
    std::vector<double> e;
    for (const int spans : levels) e.push_back(distance(shell_tip(degree, spans, gamma, membrane), exact));
    return e;
  };
  const std::vector<double> quadratic = errors(2, {8, 16, 32}), cubic = errors(3, {4, 8});
  for (std::size_t k = 1; k < quadratic.size(); ++k) EXPECT_GE(std::log2(quadratic[k - 1] / quadratic[k]), 1.8);
  EXPECT_GE(std::log2(cubic[0] / cubic[1]), 3.5);
  EXPECT_LE(quadratic.back(), 0.01 * std::hypot(exact.along, exact.drop));
  EXPECT_LE(cubic.back(), 0.01 * std::hypot(exact.along, exact.drop));
}

INSTANTIATE_TEST_SUITE_P(Gamma, ShellElastica, ::testing::Values(1.0, 10.0));

}  // namespace
}  // namespace toile
