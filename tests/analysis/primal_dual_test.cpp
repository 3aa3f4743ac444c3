// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/projection/primal_dual.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <string>

#include "analysis/flat_cloth.h"
#include "analysis/projection/fast_projection.h"
#include "analysis/projection/lagrange_newton.h"
#include "analysis/projection/row_matrix.h"
#include "analysis/projection/substeps.h"
#include "geometry/error.h"
#include "support/near.h"

namespace toile {
namespace {

using test::disturbed;
using test::flat_cloth;
using test::FlatCloth;
using test::free_map;
using test::momenta;
using test::scalar_row;
using test::strain;
using test::vertex_rows;

ConstraintRows with_stiffness(const FlatCloth& c, double stiffness) {
  ConstraintRows rows{vertex_rows(c), {}};
  for (StrainRow& row : rows.strain) row.stiffness = stiffness / ((c.n - 2) * (c.n - 2));
  return rows;
}

double largest_strain(const std::vector<StrainRow>& rows, const Eigen::VectorXd& q) {
  double largest = 0;
  for (const StrainRow& row : rows) largest = std::max(largest, std::abs(strain(row.row, q)));
  return largest;
}

constexpr PrimalDualOptions exact{.force_residual = 1e-6, .law_residual = 1e-6};

// Places and velocities of a cloth that moves under its limits alone.
struct Motion {
  Eigen::VectorXd x, v;
  ConstraintForces forces;
  double t = 0;

  ProjectionReport step(PrimalDual& solver, double dt) {
    const Eigen::VectorXd start = x;
    x += dt * v;
    t += dt;
    const ProjectionReport report = solver.step(x, v, t, start, dt, forces);
    solver.settle(v, t);
    return report;
  }
};

// One node on a spring: a row of slope d along its tangent, all other points held. The trapezoidal rule with the part r
// of the law at the end alone, then the part r of the velocity taken out.
TEST(PrimalDual, ASmallVibrationIsTheTrapezoidalRulesButForWhatTheStepDoesNotResolve) {
  const FlatCloth c = flat_cloth(2, 4);
  const int node = 2 * c.n + 2;
  std::vector<int> others;
  for (int i = 0; i < c.n * c.n; ++i)
    if (i != node) others.push_back(i);
  const AffineMap map(AffineMap::identity(c.n * c.n), others,
                      [&](std::size_t k, double) { return Eigen::Vector3d(c.rest.segment<3>(3 * others[k])); });
  ConstraintRows rows;
  for (const StrainRow& row : with_stiffness(c, 100).strain)
    if (!row.warp && rows.strain.empty() && std::ranges::find(row.row.index, node) != row.row.index.end())
      rows.strain.push_back(row);
  ASSERT_EQ(rows.strain.size(), 1u);
  const ScalarRow& row = rows.strain[0].row;
  double d = 0;
  for (std::size_t k = 0; k < row.index.size(); ++k)
    if (row.index[k] == node) d = row.value[k];
  const Eigen::VectorXd mass = map.reduce_scalar(c.mass);
  const double omega = std::abs(d) * std::sqrt(rows.strain[0].stiffness / mass[0]);
  ASSERT_GT(omega, 0);
  PrimalDual solver(map, mass, rows, exact);
  for (const double phase : {0.1, 1.0, 5.0, 100.0}) {
    const double dt = phase / omega;
    const double x0 = 1e-7, v0 = 0.3e-7 * omega;
    const Eigen::VectorXd rest = map.restrict(c.rest);
    Motion motion{rest, Eigen::VectorXd::Zero(3), {}};
    motion.x[0] += x0;
    motion.v[0] = v0;
    EXPECT_TRUE(motion.step(solver, dt).converged);
    const double s = phase * phase / 4, r = std::pow(s / (1 + s), 3);
    const double x1 = (x0 + dt * v0 - s * (1 - r) * x0) / (1 + s * (1 + r)), v1 = 2 * (x1 - x0) / dt - v0;
    // settle() sees the friction in its matrix too.
    const double stiff = s * (1 + r), left = std::pow(stiff / (1 + stiff), 3);
    EXPECT_NEAR(motion.x[0] - rest[0], x1, 1e-4 * x0) << phase;
    EXPECT_NEAR(motion.v[0], (1 - left) * v1, 1e-4 * omega * x0) << phase;
  }
}

// With laws that bite and turns of any size: each stage is a minimum of inertia and limit, at whatever step.
TEST(PrimalDual, AnyStepKeepsEveryStrainWithinTheLimit) {
  const FlatCloth c = flat_cloth(2, 8);
  for (const unsigned seed : {1u, 2u, 3u}) {
    PrimalDual solver(free_map(c), c.mass, with_stiffness(c, 1e3));
    Motion motion{c.rest, disturbed(c.rest, 1, seed) - c.rest, {}};
    for (const double dt : {1e-3, 4e-3, 1e-5, 5e-3, 2e-3}) {
      const ProjectionReport report = motion.step(solver, dt);
      EXPECT_TRUE(report.converged) << seed << ' ' << dt;
      EXPECT_LT(largest_strain(solver.rows().strain, motion.x), 0.01);
      for (std::size_t r = 0; r < solver.rows().strain.size(); ++r) {
        const StrainRow& row = solver.rows().strain[r];
        const double C = strain(row.row, motion.x), lambda = motion.forces.strain[static_cast<Eigen::Index>(r)];
        EXPECT_NEAR(C, LimitLaw({}, 1 / row.stiffness).strain(lambda), 1.01e-4);
      }
    }
  }
}

// Along the axes that a place row leaves free the cloth goes where the others take it, to the bit.
TEST(PrimalDual, APlaceRowHoldsTheComponentsThatItNames) {
  const FlatCloth c = flat_cloth(2, 6);
  const Eigen::Vector3d axes(1, 0, 1);
  ConstraintRows rows;
  for (const double u : {0.0, 0.3}) {
    const ScalarRow row = scalar_row(c, u, 0.4, 0);
    rows.place.push_back({row, 0, [at = apply(row, c.rest)](double) { return at; }, axes});
  }
  PrimalDual solver(free_map(c), c.mass, rows);
  Motion motion{c.rest, disturbed(c.rest, 1, 4) - c.rest, {}};
  Motion free = motion;
  free.x += 1e-2 * free.v;
  EXPECT_TRUE(motion.step(solver, 1e-2).converged);
  for (int k = 0; k < c.n * c.n; ++k) EXPECT_EQ(motion.x[3 * k + 1], free.x[3 * k + 1]);
  for (int p = 0; p < 2; ++p) {
    const Eigen::Vector3d off = apply(rows.place[p].row, motion.x) - apply(rows.place[p].row, c.rest);
    EXPECT_LT(off.cwiseProduct(axes).norm(), 1e-9);
    EXPECT_GT(std::abs(off.y()), 1e-4);
    EXPECT_EQ(motion.forces.place(1, p), 0);
  }
  EXPECT_THROW(FastProjection(free_map(c), c.mass, rows), SolverError);
  EXPECT_THROW(LagrangeNewton(free_map(c), c.mass, rows), SolverError);
  EXPECT_THROW(Substeps(free_map(c), c.mass, rows), SolverError);
  // Steps are taken; what can't be done is said, and what to do.
  try {
    solver.project(motion.x, 0);
    ADD_FAILURE() << "nothing was thrown";
  } catch (const SolverError& error) {
    for (const char* part : {"pin 0 holds some components", "steps keep such a pin", "start within the limit"})
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

// Cloth that a step would compress by three times the limit buckles, where tensions and laws say nothing about which
// way.
TEST(PrimalDual, WhatBucklesInAStepKeepsTheLimitToo) {
  const FlatCloth c = flat_cloth(2, 8);
  PrimalDual solver(free_map(c), c.mass, with_stiffness(c, 1e3));
  Motion motion{c.rest, Eigen::VectorXd::Zero(c.rest.size()), {}};
  motion.v = (0.97 * c.rest + 1e-6 * disturbed(c.rest, 1, 8) - c.rest) / 1e-2;
  EXPECT_TRUE(motion.step(solver, 1e-2).converged);
  EXPECT_LT(largest_strain(solver.rows().strain, motion.x), 0.01);
}

TEST(PrimalDual, StepsAreOfSecondOrderEvenWhereTheirSizesChange) {
  const FlatCloth c = flat_cloth(2, 6);
  const Eigen::VectorXd velocity = disturbed(c.rest, 0.1, 5) - c.rest;  // per second
  const auto end = [&](int steps, bool alternating) {
    PrimalDual solver(free_map(c), c.mass, with_stiffness(c, 30), exact);
    Motion motion{c.rest, velocity, {}};
    const double dt = 0.02 / steps;
    for (int k = 0; k < steps; ++k) {
      const double share = !alternating ? 1 : k % 2 == 0 ? 1.8 : 0.2;
      EXPECT_TRUE(motion.step(solver, share * dt).converged);
    }
    return motion.x;
  };
  for (const bool alternating : {false, true}) {
    std::vector<Eigen::VectorXd> x;
    for (const int steps : {40, 80, 160, 320}) x.push_back(end(steps, alternating));
    const double first = (x[1] - x[0]).norm(), second = (x[2] - x[1]).norm(), third = (x[3] - x[2]).norm();
    EXPECT_GT(first, 1e-7 * velocity.norm() * 0.02);
    EXPECT_GT(std::log2(first / second), 1.7) << alternating;
    EXPECT_GT(std::log2(second / third), 1.9) << alternating;
  }
}

TEST(PrimalDual, VibrationsTooFastForAStepDieOut) {
  const FlatCloth c = flat_cloth(2, 6);
  PrimalDual solver(free_map(c), c.mass, with_stiffness(c, 1e6));
  Motion motion{c.rest, disturbed(c.rest, 1e-3, 5) - c.rest, {}};
  motion.step(solver, 0.1);
  const double once = largest_strain(solver.rows().strain, motion.x);
  EXPECT_GT(once, 1e-12);
  for (int k = 0; k < 20; ++k) motion.step(solver, 0.1);
  EXPECT_LT(largest_strain(solver.rows().strain, motion.x), 1e-2 * once);
}

TEST(PrimalDual, KeepsMomentumExactlyAndSpinNearly) {
  const FlatCloth c = flat_cloth(2, 6);
  const auto lost = [&](double dt) {
    PrimalDual solver(free_map(c), c.mass, with_stiffness(c, 10), exact);
    Motion motion{c.rest, disturbed(c.rest, 0.3, 4) - c.rest, {}};
    for (int k = 0; k < c.mass.size(); ++k)
      motion.v.segment<3>(3 * k) += Eigen::Vector3d(1, -2, 3).cross(Eigen::Vector3d(c.rest.segment<3>(3 * k)));
    const auto before = momenta(c.mass, motion.x, motion.v);
    for (int k = 0; k < std::lround(0.032 / dt); ++k) EXPECT_TRUE(motion.step(solver, dt).converged);
    const auto after = momenta(c.mass, motion.x, motion.v);
    EXPECT_LT((after - before).head<3>().norm(), 1e-8 * before.head<3>().norm());  // rounding over dt
    return (after - before).tail<3>().norm() / before.tail<3>().norm();
  };
  EXPECT_LT(lost(1e-3), 1e-4);
  EXPECT_LT(lost(4e-4), 2e-5);
}

TEST(PrimalDual, PlaceRowsFollowTheirTargetsWithinTheStepToo) {
  const FlatCloth c = flat_cloth(2, 8);
  const auto target = [](double t) { return Eigen::Vector3d(0.5, 0.55, 0.3 * t); };
  ConstraintRows rows = with_stiffness(c, 1e3);
  rows.place.push_back({scalar_row(c, 0.41, 0.58, 0), 0, target});
  PrimalDual solver(free_map(c), c.mass, rows);
  Motion motion{c.rest, Eigen::VectorXd::Zero(c.rest.size()), {}};
  for (int k = 0; k < c.mass.size(); ++k) motion.x.segment<3>(3 * k) += target(0) - apply(rows.place[0].row, c.rest);
  for (const double dt : {1e-3, 4e-3, 1e-4, 2e-3}) {
    EXPECT_TRUE(motion.step(solver, dt).converged);
    EXPECT_LE((apply(rows.place[0].row, motion.x) - target(motion.t)).norm(), 1e-9);
    EXPECT_NEAR(apply(rows.place[0].row, motion.v).z(), 0.3, 1e-5);
  }
}

// Which rows of a band pull is for the step to find: each force has the sign of its strain, or is 0 where the strain
// lies within the slack. Rows that pulled and that other rows push back have to let go on the way.
TEST(PrimalDual, RowsOfABandPullAtTheirEndsOnlyAndNeverPush) {
  const FlatCloth c = flat_cloth(2, 8);
  const StrainBand band{.stretch = 0.02, .compress = 0.01, .slack = 0.9};
  int pull = 0, let_go = 0;
  for (const unsigned seed : {1u, 2u, 3u, 4u, 5u}) {
    SCOPED_TRACE(seed);
    PrimalDual solver(free_map(c), c.mass, with_stiffness(c, 1e4), {.weft = band, .warp = band, .tolerance = 1e-6});
    const auto& rows = solver.rows().strain;
    Motion motion{c.rest, Eigen::VectorXd::Zero(c.rest.size()), {}};
    for (unsigned k = 0; k < 6; ++k) {
      const double dt = k % 2 == 0 ? 1e-3 : 6e-4;
      motion.v = (disturbed(c.rest, 5e-4 * (1 + k % 3), 10 * seed + k) - c.rest) / dt;
      const Eigen::VectorXd before = motion.forces.strain;
      EXPECT_TRUE(motion.step(solver, dt).converged);
      for (std::size_t r = 0; r < rows.size(); ++r) {
        const double lambda = motion.forces.strain[static_cast<Eigen::Index>(r)];
        const double C = strain(rows[r].row, motion.x), end = band.slack * (C < 0 ? band.compress : band.stretch);
        EXPECT_GE(lambda * C, 0) << r;
        EXPECT_TRUE(lambda == 0 || std::abs(C) >= end - 1e-4) << r << ' ' << C;
        EXPECT_TRUE(lambda != 0 || std::abs(C) <= end + 1e-4) << r << ' ' << C;
        pull += lambda != 0;
        let_go += before.size() > 0 && lambda == 0 && before[static_cast<Eigen::Index>(r)] != 0;
      }
    }
  }
  EXPECT_GT(pull, 250);
  EXPECT_GT(let_go, 150);
}

TEST(PrimalDual, ABandLeavesTheClothAloneInside) {
  const FlatCloth c = flat_cloth(2, 8);
  const StrainBand wide{.stretch = 0.05, .compress = 0.02, .slack = 0.9};
  PrimalDual solver(free_map(c), c.mass, with_stiffness(c, 1e4), {.weft = wide, .warp = wide, .tolerance = 1e-4});
  Motion motion{1.02 * c.rest, Eigen::VectorXd::Zero(c.rest.size()), {}};  // E = 0.0202
  EXPECT_TRUE(motion.step(solver, 1e-3).converged);
  EXPECT_LT((motion.x - 1.02 * c.rest).norm(), 1e-14);
}

TEST(PrimalDual, RefusesRowsWithoutALaw) {
  const FlatCloth c = flat_cloth(2, 8);
  EXPECT_THROW(PrimalDual(free_map(c), c.mass, {vertex_rows(c), {}}), SolverError);
}

TEST(RowMatrix, SolvesAndSpreadsAsTheDenseMatrixDoes) {
  const FlatCloth c = flat_cloth(2, 6);
  const AffineMap map = free_map(c);
  const ComposedRows composed = compose(map, {vertex_rows(c), {}});
  const int rows = composed.free.size(), n = static_cast<int>(c.mass.size());
  RowMatrix matrix(composed.free, c.mass);
  matrix.scale = 3;
  const Eigen::Matrix3Xd y = Eigen::Matrix3Xd::Random(3, rows);
  Eigen::MatrixXd d = Eigen::MatrixXd::Zero(rows, n), dense = Eigen::MatrixXd::Zero(3 * n, 3 * n);
  for (int r = 0; r < rows; ++r) {
    for (int e = composed.free.start[r]; e < composed.free.start[r + 1]; ++e)
      d(r, composed.free.column[e]) = composed.free.value[e];
    if (r % 7 == 0) continue;  // takes no part
    const double slope = 1e-3 * (1 + r % 3), tension = 1e-4 * (r % 5);
    matrix.blocks[r] = SymmetricBlock::along(slope, y.col(r).data(), tension);
    const Eigen::Matrix3d block = slope * y.col(r) * y.col(r).transpose() + tension * Eigen::Matrix3d::Identity();
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) dense.block<3, 3>(3 * i, 3 * j) += d(r, i) * d(r, j) * block;
  }
  double stiffening = 0;
  for (int k = 0; k < n; ++k) {
    stiffening += dense.block<3, 3>(3 * k, 3 * k).trace() / (3 * c.mass[k] * n);
    dense.block<3, 3>(3 * k, 3 * k).diagonal().array() += 3 * c.mass[k];
  }
  expect_near_rel(matrix.stiffening(), stiffening, 1e-12);
  const Eigen::VectorXd rhs = Eigen::VectorXd::Random(3 * n), expected = dense.ldlt().solve(rhs);
  Eigen::VectorXd x(3 * n);
  ASSERT_TRUE(matrix.factorise());
  matrix.solve(rhs, x);
  EXPECT_LT((x - expected).norm(), 1e-11 * expected.norm());
  x = Eigen::VectorXd::Random(3 * n);
  ASSERT_TRUE(matrix.conjugate_gradients(rhs, x, 1e-10, 500));
  EXPECT_LT((x - expected).norm(), 1e-8 * expected.norm());
  x.setZero();
  EXPECT_FALSE(matrix.conjugate_gradients(rhs, x, 1e-10, 3));
  Eigen::VectorXd spread = Eigen::VectorXd::Ones(3 * n);
  matrix.spread(y, spread);
  const Eigen::MatrixXd expected_spread = y * d;
  EXPECT_LT((spread - Eigen::VectorXd::Ones(3 * n) - expected_spread.reshaped()).norm(), 1e-12 * spread.norm());
  Eigen::Matrix3Xd gathered(3, rows);
  matrix.gather(rhs, gathered);
  EXPECT_LT((gathered - rhs.reshaped(3, n) * d.transpose()).norm(), 1e-12 * gathered.norm());
  matrix.blocks[1].xx = -1e6;
  EXPECT_FALSE(matrix.factorise());
}

}  // namespace
}  // namespace toile
