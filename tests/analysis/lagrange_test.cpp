// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "analysis/flat_cloth.h"
#include "analysis/projection/lagrange_newton.h"
#include "support/near.h"

namespace toile {
namespace {

using test::disturbed;
using test::flat_cloth;
using test::FlatCloth;
using test::free_map;
using test::scalar_row;
using test::strain;
using test::vertex_rows;

// Eqs. (25), multiplied by M, row by row: the function that eq. (27) differentiates.
struct Equations {
  const FlatCloth& cloth;
  const ConstraintRows& rows;
  Eigen::VectorXd candidate;

  static void spread(const ScalarRow& row, const Eigen::Vector3d& w, Eigen::VectorXd& to) {
    for (std::size_t k = 0; k < row.index.size(); ++k) to.segment<3>(3 * row.index[k]) += row.value[k] * w;
  }
  Eigen::VectorXd inertia(const Eigen::VectorXd& x) const {
    Eigen::VectorXd f = x - candidate;
    for (int k = 0; k < cloth.mass.size(); ++k) f.segment<3>(3 * k) *= cloth.mass[k];
    return f;
  }
  Eigen::VectorXd force(const Eigen::VectorXd& x, const ProjectionMemory& m) const {
    Eigen::VectorXd f = inertia(x);
    for (std::size_t r = 0; r < rows.strain.size(); ++r)
      spread(rows.strain[r].row, m.strain_multipliers[r] * apply(rows.strain[r].row, x), f);
    for (std::size_t p = 0; p < rows.place.size(); ++p) spread(rows.place[p].row, m.place_multipliers.col(p), f);
    return f;
  }
  Eigen::VectorXd strains(const Eigen::VectorXd& x) const {
    Eigen::VectorXd C(rows.strain.size());
    for (std::size_t r = 0; r < rows.strain.size(); ++r) C[r] = strain(rows.strain[r].row, x);
    return C;
  }
};

ProjectionMemory along(const ProjectionMemory& at, double h, const ProjectionMemory& step) {
  return {at.strain_multipliers + h * step.strain_multipliers, at.place_multipliers + h * step.place_multipliers, {}};
}

// Each iteration moves by s with F'(z) s = -F(z), the second derivatives of the constraints included.
TEST(LagrangeNewton, AnIterationSolvesTheDerivativeOfItsEquations) {
  const FlatCloth c = flat_cloth(2, 6);
  const Eigen::Vector3d target(0.4, 0.5, 0.05);
  const ConstraintRows rows{vertex_rows(c), {{scalar_row(c, 0.37, 0.52, 0), 0, [&](double) { return target; }}}};
  const Equations equations{c, rows, disturbed(c.rest, 0.005, 3)};
  Eigen::VectorXd x[2];
  ProjectionMemory multipliers[2];
  for (int k : {0, 1}) {
    LagrangeNewton solver(free_map(c), c.mass, rows,
                          {.residual = 1e-12, .regularisation = 0, .min_iterations = 2 + k, .max_iterations = 2 + k});
    x[k] = equations.candidate;
    ASSERT_EQ(solver.project(x[k], 0).iterations, 2 + k);
    multipliers[k] = solver.memory();
  }
  const Eigen::VectorXd dx = x[1] - x[0];
  const ProjectionMemory step = along(multipliers[1], -1, multipliers[0]);
  const double h = 1e-3;
  const auto force = [&](double s) { return equations.force(x[0] + s * dx, along(multipliers[0], s, step)); };
  const Eigen::VectorXd derivative = (force(h) - force(-h)) / (2 * h);
  ASSERT_GT(dx.norm(), 1e-6);
  EXPECT_LT((derivative + force(0)).norm(), 1e-7 * force(0).norm());
  const auto C = [&](double s) { return equations.strains(x[0] + s * dx); };
  EXPECT_LT(((C(h) - C(-h)) / (2 * h) + C(0)).norm(), 1e-5 * C(0).norm());  // softness 1e-8, weakest rows 1e-3
  EXPECT_LT((apply(rows.place[0].row, x[1]) - target).norm(), 1e-9);
}

TEST(LagrangeNewton, ErrorsAreSquaredFromIterationToIteration) {
  const FlatCloth c = flat_cloth(2, 8);
  const Eigen::VectorXd candidate = disturbed(c.rest, 0.01, 4);
  double previous = 1;
  for (int n = 1; n <= 5; ++n) {
    LagrangeNewton solver(free_map(c), c.mass, {vertex_rows(c), {}}, {.residual = 1e-300, .max_iterations = n});
    Eigen::VectorXd x = candidate;
    const double error = solver.project(x, 0).residual;
    EXPECT_LT(error, std::max(10 * previous * previous, 1e-13)) << n;
    previous = error;
  }
  EXPECT_LT(previous, 1e-12);
}

TEST(LagrangeNewton, ForcesPointAlongTheGradientsAtTheEnd) {
  const FlatCloth c = flat_cloth(3, 6);
  const ConstraintRows rows{vertex_rows(c), {}};
  const Equations equations{c, rows, disturbed(c.rest, 0.02, 5)};
  LagrangeNewton solver(free_map(c), c.mass, rows, {.residual = 1e-10});
  Eigen::VectorXd x = equations.candidate;
  EXPECT_TRUE(solver.project(x, 0).converged);
  const Eigen::VectorXd impulse = equations.inertia(x);
  EXPECT_LT(equations.force(x, solver.memory()).norm(), 1e-8 * impulse.norm());
  Eigen::Vector3d linear = Eigen::Vector3d::Zero(), angular = linear;
  double size = 0;
  for (int k = 0; k < c.mass.size(); ++k) {
    linear += impulse.segment<3>(3 * k);
    angular += x.segment<3>(3 * k).cross(impulse.segment<3>(3 * k));
    size += impulse.segment<3>(3 * k).norm();
  }
  EXPECT_LT(linear.norm(), 1e-13 * size);
  EXPECT_LT(angular.norm(), 1e-9 * size);
  for (std::size_t r = 0; r < rows.strain.size(); ++r)
    EXPECT_LT(
        (solver.memory().strain_impulses.col(r) - solver.memory().strain_multipliers[r] * apply(rows.strain[r].row, x))
            .norm(),
        1e-15);
}

// However far from balance an iteration is: what it pushes sums to nothing.
TEST(LagrangeNewton, EveryIterationKeepsLinearMomentum) {
  const FlatCloth c = flat_cloth(2, 8);
  for (int n : {1, 2, 3}) {
    const ConstraintRows rows{vertex_rows(c), {}};
    const Equations equations{c, rows, disturbed(c.rest, 0.02, 6)};
    LagrangeNewton solver(free_map(c), c.mass, rows, {.residual = 1e-12, .max_iterations = n});
    Eigen::VectorXd x = equations.candidate;
    EXPECT_EQ(solver.project(x, 0).iterations, n);
    const Eigen::VectorXd impulse = equations.inertia(x);
    EXPECT_LT(impulse.reshaped(3, c.mass.size()).rowwise().sum().norm(), 1e-13 * impulse.cwiseAbs().sum());
  }
}

// The property of "closest" that the projection gives up for speed. [Peng & Zheng 2022, 3.2]
TEST(LagrangeNewton, EndsNearerToTheCandidateThanTheProjection) {
  const FlatCloth c = flat_cloth(2, 8);
  const ConstraintRows rows{vertex_rows(c), {}};
  for (unsigned seed : {1u, 2u, 3u}) {
    const Equations equations{c, rows, disturbed(c.rest, 0.02, seed)};
    const ProjectionOptions options{.tolerance = 1e-9};
    LagrangeNewton newton(free_map(c), c.mass, rows, options);
    FastProjection projection(free_map(c), c.mass, rows, options);
    Eigen::VectorXd near = equations.candidate, projected = near;
    EXPECT_TRUE(newton.project(near, 0).converged);
    EXPECT_TRUE(projection.project(projected, 0).converged);
    const auto distance = [&](const Eigen::VectorXd& x) { return equations.inertia(x).dot(x - equations.candidate); };
    EXPECT_LT(distance(near), distance(projected)) << seed;
  }
}

// Cloth compressed by a third in one step buckles: Newton's method finds no balance, the limit is kept all the same.
TEST(LagrangeNewton, WhatBucklesInAStepIsProjected) {
  const FlatCloth c = flat_cloth(2, 8);
  const ConstraintRows rows{vertex_rows(c), {}};
  LagrangeNewton solver(free_map(c), c.mass, rows);
  FastProjection projection(free_map(c), c.mass, rows);
  const Eigen::VectorXd candidate = 0.7 * c.rest + 1e-6 * disturbed(c.rest, 1, 8);
  Eigen::VectorXd x = candidate, projected = candidate;
  const ProjectionReport report = solver.project(x, 0);
  EXPECT_TRUE(report.converged);
  EXPECT_TRUE(report.damped);
  projection.project(projected, 0);
  EXPECT_EQ(x, projected);
  EXPECT_EQ(solver.memory().strain_impulses, projection.memory().strain_impulses);
}

}  // namespace
}  // namespace toile
