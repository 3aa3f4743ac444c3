// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/map/affine_map.h"

#include <gtest/gtest.h>

#include <random>

#include "geometry/error.h"
#include "support/near.h"

namespace toile {
namespace {

using Matrix = AffineMap::Matrix;

// Six control points: 4 follows (1, -3, 3) of 1, 2, 3; 5 follows 0 and 3.
Matrix sample_dependence() {
  Matrix m(6, 6);
  for (int i = 0; i < 4; ++i) m.coeffRef(i, i) = 1;
  m.coeffRef(4, 1) = 1, m.coeffRef(4, 2) = -3, m.coeffRef(4, 3) = 3;
  m.coeffRef(5, 0) = 0.25, m.coeffRef(5, 3) = 0.75;
  return m;
}

AffineMap sample_map() {
  return AffineMap(sample_dependence(), {3, 0},
                   [](std::size_t k, double t) { return Eigen::Vector3d(double(k), t, 1 + t * double(k)); });
}

Eigen::VectorXd random_vector(int n, unsigned seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> draw(-1, 1);
  Eigen::VectorXd x(n);
  for (double& value : x) value = draw(rng);
  return x;
}

TEST(AffineMap, RowsOfFreeAndFixedPartTogetherSumToOne) {
  const AffineMap map = sample_map();
  const Eigen::VectorXd sums = map.free_part() * Eigen::VectorXd::Ones(map.nodes()) +
                               map.fixed_part() * Eigen::VectorXd::Ones(map.fixed().size());
  for (int i = 0; i < map.control_points(); ++i) expect_near_rel(sums[i], 1, 1e-15);
}

TEST(AffineMap, FixedControlPointsFollowTheirMotionAndOthersTheirNodes) {
  const AffineMap map = sample_map();
  ASSERT_EQ(map.nodes(), 2);
  const Eigen::VectorXd x = random_vector(6, 1);
  Eigen::VectorXd q(18);
  map.expand(x, 2.0, q);
  EXPECT_EQ(q.segment<3>(9), Eigen::Vector3d(0, 2, 1));
  EXPECT_EQ(q.segment<3>(0), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(q.segment<3>(3), x.segment<3>(0));
  const Eigen::Vector3d follower = x.segment<3>(0) - 3 * x.segment<3>(3) + 3 * Eigen::Vector3d(0, 2, 1);
  EXPECT_LT((q.segment<3>(12) - follower).norm(), 1e-14);
}

TEST(AffineMap, ReduceIsTheAdjointOfExpand) {
  const AffineMap map = sample_map();
  const Eigen::VectorXd x = random_vector(6, 2), y = random_vector(6, 3), f = random_vector(18, 4);
  Eigen::VectorXd qx(18), qy(18), fx(6);
  map.expand(x, 1.0, qx);
  map.expand(y, 1.0, qy);
  map.reduce(f, fx);
  expect_near_rel(f.dot(qx - qy), fx.dot(x - y), 1e-13);
}

TEST(AffineMap, ReducedScalarsKeepTheirSumWhereNothingIsFixed) {
  const AffineMap map(sample_dependence(), {}, nullptr);
  const Eigen::VectorXd m = random_vector(6, 5);
  expect_near_rel(map.reduce_scalar(m).sum(), m.sum(), 1e-14, 1e-14);
}

TEST(AffineMap, RestrictUndoesExpand) {
  const AffineMap map = sample_map();
  const Eigen::VectorXd x = random_vector(6, 6);
  Eigen::VectorXd q(18);
  map.expand(x, 0.5, q);
  EXPECT_EQ(map.restrict(q), x);
}

TEST(AffineMap, RefusesChainsAndPointsFixedTwice) {
  Matrix chain = sample_dependence();
  chain.coeffRef(5, 0) = 0, chain.coeffRef(5, 4) = 0.25;
  EXPECT_THROW(AffineMap(chain, {}, nullptr), SolverError);
  const auto still = [](std::size_t, double) { return Eigen::Vector3d(0, 0, 0); };
  EXPECT_THROW(AffineMap(sample_dependence(), {1, 1}, still), SolverError);
  EXPECT_THROW(AffineMap(sample_dependence(), {6}, still), SolverError);
}

TEST(AffineMap, FixedControlPointMayBeOneThatWouldFollowOthers) {
  const AffineMap map(sample_dependence(), {4}, [](std::size_t, double) { return Eigen::Vector3d(7, 8, 9); });
  EXPECT_EQ(map.nodes(), 4);
  Eigen::VectorXd q(18);
  map.expand(random_vector(12, 7), 0, q);
  EXPECT_EQ(q.segment<3>(12), Eigen::Vector3d(7, 8, 9));
}

}  // namespace
}  // namespace toile
