// SPDX-License-Identifier: GPL-3.0-or-later
// The shell's quadrature of p points a direction, against p + 1: what it sees, and how fast its error falls.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>

#include "analysis/shell/shell_model.h"
#include "support/near.h"
#include "support/panels.h"
#include "trimming/topology.h"

namespace toile {
namespace {

// Uncut cells where `inside` says so, nothing elsewhere.
CutQuadrature rule_on(const NurbsSurface& surface, const std::vector<bool>& inside, const QuadratureOptions& options) {
  TrimmedSurface face;
  face.surface = surface;
  TrimTopology topology;
  topology.mesh = {surface.u().breaks(), surface.v().breaks()};
  for (const bool in : inside) topology.cells.push_back(in ? CellKind::inside : CellKind::outside);
  return quadrature(face, topology, options);
}

CutQuadrature rule_on(const NurbsSurface& surface, const QuadratureOptions& options) {
  const std::size_t cells = (surface.u().breaks().size() - 1) * (surface.v().breaks().size() - 1);
  return rule_on(surface, std::vector<bool>(cells, true), options);
}

Eigen::MatrixXd stiffness(const NurbsSurface& surface, const CutQuadrature& rule) {
  ClothPanel panel = test::make_panel(surface);
  panel.quadrature = rule;
  const ShellModel model({panel});
  const Eigen::Index n = model.rest().size();
  Eigen::MatrixXd k(n, n);
  Eigen::VectorXd df(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    model.apply_tangent(model.rest(), Eigen::VectorXd::Unit(n, i), df, TangentKind::exact);
    k.col(i) = df;
  }
  return 0.5 * (k + k.transpose());
}

// The smallest share that the shell's rule sees of the energy of any motion with energy by full quadrature.
double least_seen(const NurbsSurface& surface, const std::vector<bool>& inside) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> full(stiffness(surface, rule_on(surface, inside, {})));
  const double top = full.eigenvalues().maxCoeff();
  std::vector<Eigen::VectorXd> modes;
  for (Eigen::Index k = 0; k < full.eigenvalues().size(); ++k)
    if (full.eigenvalues()[k] > 1e-10 * top)
      modes.push_back(full.eigenvectors().col(k) / std::sqrt(full.eigenvalues()[k]));
  Eigen::MatrixXd scaled(full.eigenvalues().size(), static_cast<Eigen::Index>(modes.size()));
  for (std::size_t k = 0; k < modes.size(); ++k) scaled.col(static_cast<Eigen::Index>(k)) = modes[k];
  const Eigen::MatrixXd seen =
      scaled.transpose() * stiffness(surface, rule_on(surface, inside, shell_quadrature(surface))) * scaled;
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(seen, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

std::size_t points_of(const NurbsSurface& surface, const std::vector<bool>& inside) {
  return rule_on(surface, inside, shell_quadrature(surface)).points.size();
}

TEST(ShellQuadrature, TakesAPointLessWhereClothGoesOn) {
  const NurbsSurface sheet = test::flat_surface(1, 1, uniform_knots(2, 3), uniform_knots(2, 2));
  const auto inside = [](const char* text) {
    std::vector<bool> in;
    for (; *text; ++text) in.push_back(*text == 'x');
    return in;
  };
  EXPECT_EQ(points_of(sheet, inside("xxxxxx")), 6u * 2 * 2);
  EXPECT_EQ(points_of(sheet, inside("x.x.x.")), 3u * 3 * 3) << "cells that meet at corners only are alone";
  EXPECT_EQ(points_of(sheet, inside("xxx...")), 3u * 2 * 3) << "a strap one cell wide";
  EXPECT_EQ(points_of(sheet, inside("xx.x..")), 2u * 2 + 2u * 3 + 3u * 2) << "an angle";
  const NurbsSurface creased =
      test::flat_surface(1, 1, KnotVector(2, {0, 0, 0, 0.5, 0.5, 1, 1, 1}), uniform_knots(2, 3));
  EXPECT_EQ(rule_on(creased, shell_quadrature(creased)).points.size(), 6u * 3 * 2) << "a C0 line parts the cloth";
  const NurbsSurface rational = test::bumpy_surface(2, 3, 3, true);
  EXPECT_EQ(rule_on(rational, shell_quadrature(rational)).points.size(), 9u * 3 * 3);
}

TEST(ShellQuadrature, NoMotionGoesUnseen) {
  for (int p = 2; p <= 4; ++p)
    for (const auto& [nu, nv] : {std::pair(1, 1), std::pair(1, 4), std::pair(2, 2), std::pair(2, 3), std::pair(4, 4)}) {
      const NurbsSurface sheet = test::flat_surface(1, 0.7, uniform_knots(p, nu), uniform_knots(p, nv));
      EXPECT_GT(least_seen(sheet, std::vector<bool>(nu * nv, true)), 0.5) << "p " << p << ", " << nu << " x " << nv;
    }
  const NurbsSurface creased =
      test::flat_surface(1, 1, KnotVector(2, {0, 0, 0, 0.3, 0.3, 0.5, 0.5, 1, 1, 1}), uniform_knots(2, 3));
  EXPECT_GT(least_seen(creased, std::vector<bool>(9, true)), 0.5) << "C0 lines";
  const NurbsSurface graded = test::flat_surface(1, 1, clamped_knots(3, std::vector{0.0, 0.01, 0.02, 0.4, 1.0}),
                                                 clamped_knots(3, std::vector{0.0, 0.001, 1.0}));
  EXPECT_GT(least_seen(graded, std::vector<bool>(8, true)), 0.45) << "uneven spans";
}

// Cloth of whole cells, in any arrangement.
TEST(ShellQuadrature, NoMotionGoesUnseenInRaggedCloth) {
  std::mt19937 random(5);
  for (int p = 2; p <= 3; ++p)
    for (int trial = 0; trial < 12; ++trial) {
      const NurbsSurface sheet = test::flat_surface(1, 1, uniform_knots(p, 4), uniform_knots(p, 4));
      std::vector<bool> inside(16);
      for (std::size_t k = 0; k < inside.size(); ++k) inside[k] = random() % 3 > 0;
      if (std::ranges::count(inside, true) == 0) continue;
      EXPECT_GT(least_seen(sheet, inside), 0.4) << "p " << p << ", trial " << trial;
    }
}

// Energy of a smooth bend and stretch against a fine rule: O(h^2p) of it is lost, as by full quadrature.
TEST(ShellQuadrature, KeepsTheOrder) {
  for (int p = 2; p <= 3; ++p) {
    std::vector<double> errors;
    for (int n : {p == 2 ? 8 : 5, p == 2 ? 16 : 10}) {
      const NurbsSurface sheet = test::flat_surface(1, 1, uniform_knots(p, n), uniform_knots(p, n));
      Fabric fabric;
      fabric.bending = {.b0 = 0.01, .kappa0 = 3, .kappa_reg = 0.5};
      const auto energy = [&](const CutQuadrature& rule) {
        ClothPanel panel = test::make_panel(sheet, fabric);
        panel.quadrature = rule;
        const ShellModel model({panel});
        Eigen::VectorXd q = model.rest(), force(q.size());
        for (Eigen::Index k = 0; k < q.size(); k += 3) {
          const double x = q[k], y = q[k + 1];
          q[k] += 0.02 * std::sin(3 * x + y);
          q[k + 1] += 0.03 * std::cos(2 * y - x);
          q[k + 2] += 0.2 * std::sin(2 * x) * std::cos(3 * y);
        }
        return model.internal_force(q, force).total();
      };
      const double exact = energy(test::tensor_quadrature(sheet, p + 4));
      errors.push_back(std::abs(energy(rule_on(sheet, shell_quadrature(sheet))) / exact - 1));
    }
    EXPECT_GT(std::log2(errors[0] / errors[1]), 2 * p - 0.7) << "p " << p << ": " << errors[0] << ", " << errors[1];
    EXPECT_LT(errors[1], 1e-4);
  }
}

}  // namespace
}  // namespace toile
