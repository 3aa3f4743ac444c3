// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>

#include "analysis/flat_cloth.h"
#include "analysis/projection/fast_projection.h"
#include "analysis/projection/lagrange_newton.h"
#include "analysis/projection/limit_law.h"
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
      impulse.segment<3>(3 * row.index[k]) -= projection.memory().strain_multipliers[r] * row.value[k] * y;
  }
  const ScalarRow& pin = projection.rows().place[0].row;
  for (std::size_t k = 0; k < pin.index.size(); ++k)
    impulse.segment<3>(3 * pin.index[k]) -= pin.value[k] * projection.memory().place_multipliers.col(0);
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
  for (int k = 0; k < 2 * 9; k += 2) EXPECT_EQ(projection.memory().strain_multipliers[k], 0);  // weft rows along v = 0
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
    for (const double part : {-0.99, -0.95, -0.92, -0.3, 0.3, 0.92, 0.95, 0.99, 1.02}) {
      const double strain = part * (part < 0 ? 0.05 : 0.02);
      if (std::abs(part) <= slack) {
        EXPECT_EQ(law.multiplier(strain), 0);
        EXPECT_EQ(law.energy(strain), 0);
        EXPECT_TRUE(law.slack_at(strain));
        continue;
      }
      const double lambda = law.multiplier(strain), h = 1e-6 * std::abs(lambda), d = 1e-7 * std::abs(strain);
      expect_near_rel((law.energy(strain + d) - law.energy(strain - d)) / (2 * d), lambda, 1e-5);
      expect_near_rel((law.multiplier(strain + d) - law.multiplier(strain - d)) / (2 * d), law.stiffness(strain), 1e-5);
      expect_near_rel(law.slope(lambda), (law.strain(lambda + h) - law.strain(lambda - h)) / (2 * h), 1e-5);
      if (std::abs(part) > slack + 0.98 * (1 - slack)) continue;  // beyond the wall forces go on straight
      expect_near_rel(law.strain(lambda), strain, 1e-12);
      expect_near_rel(law.slope(lambda) * law.stiffness(strain), 1, 1e-12);
    }
    EXPECT_EQ(law.strain(0.0), slack * 0.02);
    EXPECT_EQ(law.strain(-0.0), -slack * 0.05);
    for (const double lambda : {1e3, 1e9}) {
      EXPECT_LT(law.strain(lambda), 0.02);
      EXPECT_GT(law.strain(-lambda), -0.05);
    }
  }
}

}  // namespace
}  // namespace toile
