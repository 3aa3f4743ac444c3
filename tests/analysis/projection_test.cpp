// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>

#include "analysis/flat_cloth.h"
#include "analysis/projection/fast_projection.h"
#include "analysis/projection/lagrange_newton.h"
#include "geometry/error.h"
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

// Corners (0,0) and (1,0) held at rest.
AffineMap two_corners(const FlatCloth& c) {
  const Eigen::VectorXd rest = c.rest;
  const std::vector<int> corners{0, c.n - 1};
  return AffineMap(AffineMap::identity(c.n * c.n), corners,
                   [rest, corners](std::size_t k, double) { return Eigen::Vector3d(rest.segment<3>(3 * corners[k])); });
}

double largest_strain(const std::vector<StrainRow>& rows, const Eigen::VectorXd& q) {
  double largest = 0;
  for (const StrainRow& row : rows) largest = std::max(largest, std::abs(strain(row.row, q)));
  return largest;
}

// Laws of both solvers.
template <class Solver>
class AnySolver : public ::testing::Test {};
using Solvers = ::testing::Types<FastProjection, LagrangeNewton>;
TYPED_TEST_SUITE(AnySolver, Solvers);

TYPED_TEST(AnySolver, ReachesItsToleranceAndReportsTheTrueViolation) {
  const FlatCloth c = flat_cloth(2, 8);
  const AffineMap map = free_map(c);
  for (double tolerance : {1e-2, 1e-6}) {
    TypeParam projection(map, c.mass, {vertex_rows(c), {}}, {.tolerance = tolerance});
    Eigen::VectorXd x = disturbed(c.rest, 0.02, 3);
    ASSERT_GT(largest_strain(vertex_rows(c), x), 0.05);
    const ProjectionReport report = projection.project(x, 0);
    EXPECT_TRUE(report.converged);
    EXPECT_LE(largest_strain(vertex_rows(c), x), tolerance);
    expect_near_rel(report.strain_violation, largest_strain(vertex_rows(c), x), 1e-9, 1e-14);
    ASSERT_GE(report.worst_row, 0);
    expect_near_rel(std::abs(strain(projection.rows().strain[report.worst_row].row, x)), report.strain_violation, 1e-9,
                    1e-14);
  }
}

TYPED_TEST(AnySolver, SaysThatItDidNotConverge) {
  const FlatCloth c = flat_cloth(2, 8);
  TypeParam projection(free_map(c), c.mass, {vertex_rows(c), {}}, {.tolerance = 1e-9, .max_iterations = 1});
  Eigen::VectorXd x = disturbed(c.rest, 0.02, 3);
  const ProjectionReport report = projection.project(x, 0);
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.iterations, 1);
  EXPECT_GT(report.strain_violation, 1e-9);
}

TYPED_TEST(AnySolver, PlacesThatAreNoNumbersMeetNothing) {
  const FlatCloth c = flat_cloth(2, 8);
  TypeParam projection(free_map(c), c.mass, {vertex_rows(c), {}});
  for (const Eigen::Index at : {Eigen::Index{0}, c.rest.size() - 1}) {
    Eigen::VectorXd x = c.rest;
    x[at] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(projection.measure(x, 0).converged) << at;
    EXPECT_FALSE(projection.project(x, 0).converged) << at;
  }
}

TYPED_TEST(AnySolver, ProjectsOnceEvenWhereEverythingIsMet) {
  const FlatCloth c = flat_cloth(2, 8);
  TypeParam projection(free_map(c), c.mass, {vertex_rows(c), {}});
  Eigen::VectorXd x = disturbed(c.rest, 1e-5, 3);
  const double before = largest_strain(vertex_rows(c), x);
  const ProjectionReport report = projection.project(x, 0);
  EXPECT_EQ(report.iterations, 1);
  EXPECT_LT(largest_strain(vertex_rows(c), x), 0.1 * before);
}

TYPED_TEST(AnySolver, NeverMovesFixedControlPoints) {
  const FlatCloth c = flat_cloth(2, 8);
  const AffineMap map = two_corners(c);
  TypeParam projection(map, map.reduce_scalar(c.mass), {vertex_rows(c), {}});
  Eigen::VectorXd x = map.restrict(disturbed(c.rest, 0.02, 4)), q(c.rest.size());
  EXPECT_TRUE(projection.project(x, 0).converged);
  map.expand(x, 0, q);
  for (int corner : {0, c.n - 1}) EXPECT_EQ(q.segment<3>(3 * corner), c.rest.segment<3>(3 * corner));
  EXPECT_LE(largest_strain(vertex_rows(c), q), 0.01);
}

TEST(FastProjection, KeepsLinearMomentumAndExertsNoMomentOnAFreeCloth) {
  const FlatCloth c = flat_cloth(3, 6);
  FastProjection projection(free_map(c), c.mass, {vertex_rows(c), {}}, {.tolerance = 1e-12, .max_iterations = 1});
  Eigen::VectorXd x = disturbed(c.rest, 0.02, 5);
  for (int iteration = 0; iteration < 4; ++iteration) {
    const Eigen::VectorXd before = x;
    projection.project(x, 0);
    Eigen::Vector3d linear = Eigen::Vector3d::Zero(), angular = linear;
    double size = 0;
    for (int k = 0; k < c.mass.size(); ++k) {
      const Eigen::Vector3d impulse = c.mass[k] * (x - before).segment<3>(3 * k);
      const Eigen::Vector3d place = before.segment<3>(3 * k);
      linear += impulse;
      angular += place.cross(impulse);
      size += impulse.norm();
    }
    ASSERT_GT(size, 0);
    EXPECT_LT(linear.norm(), 1e-13 * size + 1e-16);
    EXPECT_LT(angular.norm(), 1e-13 * size + 1e-16);
  }
}

TEST(FastProjection, MovesByTheMultipliersItReports) {
  const FlatCloth c = flat_cloth(2, 8);
  const Eigen::Vector3d target(0.4, 0.5, 0.1);
  FastProjection projection(free_map(c), c.mass,
                            {vertex_rows(c), {{scalar_row(c, 0.37, 0.52, 0), 0, [&](double) { return target; }}}},
                            {.max_iterations = 1});
  const Eigen::VectorXd before = disturbed(c.rest, 0.02, 6);
  Eigen::VectorXd x = before;
  projection.project(x, 0);
  Eigen::VectorXd impulse = Eigen::VectorXd::Zero(x.size());
  for (std::size_t r = 0; r < projection.rows().strain.size(); ++r) {
    const ScalarRow& row = projection.rows().strain[r].row;
    Eigen::Vector3d y = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < row.index.size(); ++k) y += row.value[k] * before.segment<3>(3 * row.index[k]);
    for (std::size_t k = 0; k < row.index.size(); ++k)
      impulse.segment<3>(3 * row.index[k]) -= projection.strain_multipliers()[r] * row.value[k] * y;
  }
  const ScalarRow& pin = projection.rows().place[0].row;
  for (std::size_t k = 0; k < pin.index.size(); ++k)
    impulse.segment<3>(3 * pin.index[k]) -= pin.value[k] * projection.place_multipliers().col(0);
  for (int k = 0; k < c.mass.size(); ++k)
    for (int a = 0; a < 3; ++a) expect_near_rel(c.mass[k] * (x - before)[3 * k + a], impulse[3 * k + a], 1e-9, 1e-15);
}

TEST(FastProjection, LeastChangeOfKineticEnergy) {
  // Whatever also meets the linearised constraints is no nearer: the move is M-orthogonal to their null space. Nodes
  // that no row touches don't move at all.
  const FlatCloth c = flat_cloth(2, 4);
  std::vector<StrainRow> rows = vertex_rows(c);
  rows.resize(6);
  FastProjection projection(free_map(c), c.mass, {rows, {}}, {.regularisation = 0, .max_iterations = 1});
  const Eigen::VectorXd before = disturbed(c.rest, 0.02, 7);
  Eigen::VectorXd x = before;
  projection.project(x, 0);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(rows.size(), x.size());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    Eigen::Vector3d y = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < rows[r].row.index.size(); ++k)
      y += rows[r].row.value[k] * before.segment<3>(3 * rows[r].row.index[k]);
    for (std::size_t k = 0; k < rows[r].row.index.size(); ++k)
      jacobian.block<1, 3>(r, 3 * rows[r].row.index[k]) = rows[r].row.value[k] * y.transpose();
    expect_near_rel(jacobian.row(r).dot(x - before), -strain(rows[r].row, before), 1e-9, 1e-14);
  }
  const Eigen::MatrixXd null_space = jacobian.fullPivLu().kernel();
  Eigen::VectorXd weighted = x - before;
  for (int k = 0; k < c.mass.size(); ++k) weighted.segment<3>(3 * k) *= c.mass[k];
  EXPECT_LT((null_space.transpose() * weighted).norm(), 1e-12 * null_space.norm() * weighted.norm());
}

TYPED_TEST(AnySolver, PlaceRowsFollowTheirTargets) {
  const FlatCloth c = flat_cloth(2, 8);
  const AffineMap map = two_corners(c);
  const auto target = [](double t) { return Eigen::Vector3d(0.5, 0.55, 0.3 * t); };
  const ScalarRow row = scalar_row(c, 0.41, 0.58, 0);
  TypeParam projection(map, map.reduce_scalar(c.mass), {vertex_rows(c), {{row, 0, target}}});
  Eigen::VectorXd x = map.restrict(c.rest), q(c.rest.size());
  for (double t : {0.1, 0.2, 0.3}) {
    const ProjectionReport report = projection.project(x, t);
    EXPECT_TRUE(report.converged);
    map.expand(x, t, q);
    Eigen::Vector3d y = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < row.index.size(); ++k) y += row.value[k] * q.segment<3>(3 * row.index[k]);
    EXPECT_LE((y - target(t)).norm(), 1e-9);
    EXPECT_LE(largest_strain(vertex_rows(c), q), 0.01);
  }
}

TYPED_TEST(AnySolver, RowsOnFixedControlPointsOnlyTakeNoPart) {
  const FlatCloth c = flat_cloth(2, 8);
  const Eigen::VectorXd stretched = 1.2 * c.rest;
  std::vector<int> edge;
  for (int i = 0; i < c.n; ++i) edge.push_back(i);
  const AffineMap map(AffineMap::identity(c.n * c.n), edge, [&](std::size_t k, double) {
    return Eigen::Vector3d(stretched.segment<3>(3 * edge[k]));  // the edge itself breaks its strain rows for good
  });
  const std::vector<StrainRow> all = vertex_rows(c);
  TypeParam projection(map, map.reduce_scalar(c.mass), {all, {}});
  Eigen::VectorXd x = map.restrict(c.rest);
  const ProjectionReport report = projection.project(x, 0);
  EXPECT_TRUE(x.allFinite());
  for (int k = 0; k < 2 * 9; k += 2) EXPECT_EQ(projection.strain_multipliers()[k], 0);  // weft rows along v = 0
  EXPECT_TRUE(report.worst_row < 0 || report.worst_row >= 2 * 9 || report.worst_row % 2 == 1);
}

TYPED_TEST(AnySolver, ContradictingRowsEndUnconvergedAndFinite) {
  const FlatCloth c = flat_cloth(2, 8);
  const auto place = [](double x) { return [x](double) { return Eigen::Vector3d(x, 0.5, 0); }; };
  TypeParam projection(
      free_map(c), c.mass,
      {vertex_rows(c), {{scalar_row(c, 0, 0.5, 0), 0, place(0.0)}, {scalar_row(c, 1, 0.5, 0), 1, place(1.3)}}},
      {.max_iterations = 1000});
  Eigen::VectorXd x = c.rest;
  const ProjectionReport report = projection.project(x, 0);
  EXPECT_FALSE(report.converged);
  EXPECT_TRUE(x.allFinite());
  EXPECT_LT(report.iterations, 150);  // given up, not used up; one solver tries twice
}

TYPED_TEST(AnySolver, TwoPinnedCornersOfAStraightEdgeStayFiniteThoughTheRowsDepend) {
  const FlatCloth c = flat_cloth(2, 8);
  const AffineMap map = two_corners(c);
  TypeParam projection(map, map.reduce_scalar(c.mass), {vertex_rows(c), {}});
  Eigen::VectorXd x = map.restrict(c.rest);
  // Exactly singular at rest: the sum of the edge's weft rows is the distance of the two pins.
  Eigen::VectorXd moved = x;
  for (int k = 0; k < map.nodes(); ++k) moved[3 * k + 2] -= 1e-5;
  const ProjectionReport report = projection.project(moved, 0);
  EXPECT_TRUE(report.converged);
  EXPECT_LT((moved - x).cwiseAbs().maxCoeff(), 1e-3);
}

TYPED_TEST(AnySolver, RefusesPinsOnFixedControlPointsAndNodesWithoutMass) {
  const FlatCloth c = flat_cloth(2, 8);
  const AffineMap map = two_corners(c);
  const auto target = [](double) { return Eigen::Vector3d(0, 0, 0); };
  EXPECT_THROW(TypeParam(map, map.reduce_scalar(c.mass), {{}, {{scalar_row(c, 0, 0, 0), 3, target}}}), SolverError);
  Eigen::VectorXd mass = map.reduce_scalar(c.mass);
  mass[5] = 0;
  EXPECT_THROW(TypeParam(map, mass, {vertex_rows(c), {}}), SolverError);
}

TEST(LimitLaw, StrainAndMultiplierAreInversesAndTheEnergyIsTheIntegral) {
  for (const double slack : {0.0, 0.9}) {
    const LimitLaw law({.stretch = 0.02, .compress = 0.05, .slack = slack}, 3e-4);
    for (const double part : {-0.99, -0.95, -0.92, -0.3, 0.3, 0.92, 0.95, 0.99}) {
      const double strain = part * (part < 0 ? 0.05 : 0.02);
      if (std::abs(part) <= slack) {
        EXPECT_EQ(law.multiplier(strain), 0);
        EXPECT_EQ(law.energy(strain), 0);
        EXPECT_TRUE(law.slack_at(strain));
        continue;
      }
      if (std::abs(part) > slack + 0.98 * (1 - slack)) continue;  // the wall itself
      const double lambda = law.multiplier(strain), h = 1e-6 * std::abs(lambda), d = 1e-7 * std::abs(strain);
      expect_near_rel(law.strain(lambda), strain, 1e-12);
      expect_near_rel(law.slope(lambda), (law.strain(lambda + h) - law.strain(lambda - h)) / (2 * h), 1e-5);
      expect_near_rel((law.energy(strain + d) - law.energy(strain - d)) / (2 * d), lambda, 1e-5);
    }
    EXPECT_EQ(law.strain(0.0), slack * 0.02);
    EXPECT_EQ(law.strain(-0.0), -slack * 0.05);
    for (const double lambda : {1e3, 1e9}) {
      EXPECT_LT(law.strain(lambda), 0.02);
      EXPECT_GT(law.strain(-lambda), -0.05);
    }
  }
}

ConstraintRows with_stiffness(const FlatCloth& c, double stiffness) {
  ConstraintRows rows{vertex_rows(c), {}};
  for (StrainRow& row : rows.strain) row.stiffness = stiffness / ((c.n - 2) * (c.n - 2));
  return rows;
}

// By J^T multipliers with the gradients at `at`.
Eigen::VectorXd impulse_of(const FastProjection& projection, const Eigen::VectorXd& multipliers,
                           const Eigen::VectorXd& at) {
  Eigen::VectorXd impulse = Eigen::VectorXd::Zero(at.size());
  const auto& rows = projection.rows().strain;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const Eigen::Vector3d y = apply(rows[r].row, at);
    for (std::size_t k = 0; k < rows[r].row.index.size(); ++k)
      impulse.segment<3>(3 * rows[r].row.index[k]) -= multipliers[r] * rows[r].row.value[k] * y;
  }
  return impulse;
}

TEST(FastProjection, AStepSolvesTheLimitLawAlongTheGradientsOfItsStart) {
  const FlatCloth c = flat_cloth(2, 8);
  const double dt = 1e-3;
  FastProjection projection(free_map(c), c.mass, with_stiffness(c, 1e4), {.residual = 1e-9});
  const auto& rows = projection.rows().strain;
  const Eigen::VectorXd candidate = disturbed(c.rest, 2e-4, 7);
  ConstraintForces forces;
  forces.strain = Eigen::Matrix3Xd::Random(3, rows.size()) * 1e-3;
  const Eigen::Matrix3Xd before = forces.strain;
  Eigen::VectorXd x = candidate;
  const ProjectionReport report = projection.step(x, dt, c.rest, dt, forces);
  EXPECT_TRUE(report.converged);
  EXPECT_FALSE(report.damped);
  Eigen::VectorXd mean(rows.size());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const double lambda = projection.strain_multipliers()[r];
    const LimitLaw law({}, 1 / (rows[r].stiffness * dt * dt));
    expect_near_rel(strain(rows[r].row, x), law.strain(lambda), 1e-6, 1e-10);
    expect_near_rel(forces.strain(0, r), lambda / (dt * dt), 1e-12);
    EXPECT_EQ(forces.strain(1, r), before(0, r));
    EXPECT_EQ(forces.strain(2, r), before(1, r));
    mean[r] = (8 * lambda + dt * dt * (12 * before(0, r) + 6 * before(1, r) + before(2, r))) / 27;
  }
  const Eigen::VectorXd impulse = impulse_of(projection, mean, c.rest);
  for (int k = 0; k < c.mass.size(); ++k)
    for (int a = 0; a < 3; ++a)
      expect_near_rel(c.mass[k] * (x - candidate)[3 * k + a], impulse[3 * k + a], 1e-9, 1e-15);
}

// Which rows of a band pull is for the step to find: each multiplier has the sign of its strain, or is 0 where the
// strain lies within the slack. Rows that pulled and that the candidate or other rows push back have to let go on the
// way.
TEST(FastProjection, RowsOfABandPullAtTheirEndsOnlyAndNeverPush) {
  const FlatCloth c = flat_cloth(2, 8);
  const StrainBand band{.stretch = 0.02, .compress = 0.01, .slack = 0.9};
  for (const unsigned seed : {1u, 2u, 3u, 4u, 5u}) {
    SCOPED_TRACE(seed);
    FastProjection projection(free_map(c), c.mass, with_stiffness(c, 1e4),
                              {.weft = band, .warp = band, .tolerance = 1e-6, .residual = 1e-8});
    const auto& rows = projection.rows().strain;
    ConstraintForces forces;
    forces.strain.setZero(3, static_cast<Eigen::Index>(rows.size()));
    int pull = 0, let_go = 0;
    for (unsigned k = 0; k < 6; ++k) {
      const double dt = k % 2 == 0 ? 1e-3 : 6e-4;
      const Eigen::VectorXd before = forces.strain.row(0);
      Eigen::VectorXd x = disturbed(c.rest, 5e-4 * (1 + k % 3), 10 * seed + k);
      const ProjectionReport report = projection.step(x, dt, c.rest, dt, forces);
      EXPECT_TRUE(report.converged);
      const double allowed = 0.1 * band.compress;  // residual of a step that damps, of the narrower limit
      for (std::size_t r = 0; r < rows.size(); ++r) {
        const double lambda = projection.strain_multipliers()[static_cast<Eigen::Index>(r)];
        const double C = strain(rows[r].row, x), end = band.slack * (C < 0 ? band.compress : band.stretch);
        EXPECT_GE(lambda * C, 0) << r;
        EXPECT_TRUE(lambda == 0 || std::abs(C) >= end - allowed) << r << ' ' << C;
        EXPECT_TRUE(lambda != 0 || std::abs(C) <= end + allowed) << r << ' ' << C;
        pull += lambda != 0;
        let_go += lambda == 0 && before[static_cast<Eigen::Index>(r)] != 0;
      }
    }
    EXPECT_GT(pull, 50);
    EXPECT_GT(let_go, 30);
  }
}

// Places of a cloth that starts flat, with velocities, under its strain limits alone.
Eigen::VectorXd vibrate(const FlatCloth& c, double stiffness, const Eigen::VectorXd& velocity, double dt, int steps) {
  FastProjection projection(free_map(c), c.mass, with_stiffness(c, stiffness), {.residual = 1e-12});
  ConstraintForces forces;
  Eigen::VectorXd x = c.rest, v = velocity;
  for (int k = 0; k < steps; ++k) {
    const Eigen::VectorXd start = x;
    x += dt * v;
    EXPECT_FALSE(projection.step(x, (k + 1) * dt, start, dt, forces).damped);
    v = (x - start) / dt;
  }
  return x;
}

TEST(FastProjection, VibrationsWithinTheLimitAreOfSecondOrder) {
  const FlatCloth c = flat_cloth(2, 6);
  const Eigen::VectorXd velocity = disturbed(c.rest, 1e-3, 5) - c.rest;  // per second
  std::vector<Eigen::VectorXd> x;
  for (const int steps : {20, 40, 80, 160}) x.push_back(vibrate(c, 30, velocity, 0.02 / steps, steps));
  const double first = (x[1] - x[0]).norm(), second = (x[2] - x[1]).norm(), third = (x[3] - x[2]).norm();
  EXPECT_GT(first, 1e-6 * velocity.norm() * 0.02);
  EXPECT_GT(std::log2(first / second), 1.7);
  EXPECT_GT(std::log2(second / third), 1.9);
}

TEST(FastProjection, VibrationsTooFastForAStepDieOut) {
  const FlatCloth c = flat_cloth(2, 6);
  const Eigen::VectorXd velocity = disturbed(c.rest, 1e-3, 5) - c.rest;
  const ConstraintRows rows = with_stiffness(c, 1);
  const auto largest = [&](const Eigen::VectorXd& x) {
    double most = 0;
    for (const StrainRow& row : rows.strain) most = std::max(most, std::abs(strain(row.row, x)));
    return most;
  };
  // dt^2 k / m of some 1e6: what the first step stretches is gone after thirty; what stays holds the cloth as it turns.
  const double once = largest(vibrate(c, 1e6, velocity, 0.1, 1));
  EXPECT_GT(once, 1e-11);
  EXPECT_LT(largest(vibrate(c, 1e6, velocity, 0.1, 30)), 2e-3 * once);
}

TEST(FastProjection, ABandLeavesTheClothAloneInsideAndHoldsItAtItsEnds) {
  const FlatCloth c = flat_cloth(2, 8);
  const StrainBand wide{.stretch = 0.05, .compress = 0.02, .slack = 0.9};
  FastProjection projection(free_map(c), c.mass, with_stiffness(c, 1e4),
                            {.weft = wide, .warp = wide, .tolerance = 1e-4});
  Eigen::VectorXd inside = 1.02 * c.rest;  // E = 0.0202
  const Eigen::VectorXd before = inside;
  ConstraintForces none;
  EXPECT_TRUE(projection.step(inside, 1e-3, inside, 1e-3, none).converged);
  EXPECT_EQ(inside, before);
  for (const double factor : {1.1, 0.9}) {
    Eigen::VectorXd x = factor * c.rest;
    ConstraintForces forces;
    EXPECT_TRUE(projection.step(x, 1e-3, c.rest, 1e-3, forces).converged) << factor;
    for (const StrainRow& row : projection.rows().strain) {
      EXPECT_LE(strain(row.row, x), 0.05 + 1e-4);
      EXPECT_GE(strain(row.row, x), -0.02 - 1e-4);
    }
  }
}

}  // namespace
}  // namespace toile
