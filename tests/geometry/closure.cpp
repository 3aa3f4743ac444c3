// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/closure.h"

#include <gtest/gtest.h>

#include "geometry/refine.h"

namespace toile {
namespace {

// 5 x 4 control points of degree 2 in u and v, closed in u up to `gap`.
NurbsSurface ring(double gap, std::vector<double> weights = {}) {
  const Eigen::Vector3d round[] = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {1, -gap, 0}};
  Eigen::Matrix3Xd points(3, 20);
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 5; ++i) points.col(i + 5 * j) = round[i] + Eigen::Vector3d(0, 0, j);
  return {uniform_knots(2, 3), uniform_knots(2, 2), points, std::move(weights)};
}

TEST(Closure, IsFoundWithinTheTolerance) {
  EXPECT_TRUE(find_closure(ring(1e-6), 1e-5).u);
  EXPECT_FALSE(find_closure(ring(1e-6), 1e-7).u);
  EXPECT_FALSE(find_closure(ring(0), 1e-7).v);
}

TEST(Closure, NeedsWeightsInOneRatio) {
  std::vector<double> weights(20, 1.0);
  EXPECT_TRUE(find_closure(ring(0, weights), 1e-9).u);
  for (const std::size_t k : {4u, 9u, 14u, 19u}) weights[k] = 3;
  EXPECT_TRUE(find_closure(ring(0, weights), 1e-9).u);
  weights[5] = 2;
  EXPECT_TRUE(ends_meet(ring(0, weights), Direction::u, 1e-9));
  EXPECT_FALSE(find_closure(ring(0, weights), 1e-9).u);
}

TEST(Closure, ClosingMakesTheLastLineTheFirstBitwise) {
  const NurbsSurface open = ring(1e-6), closed = close_exactly(open, {true, false});
  const std::vector<int> leader = seam_leaders(open, {true, false});
  for (int k = 0; k < 20; ++k) {
    EXPECT_EQ(leader[static_cast<std::size_t>(k)], k % 5 == 4 ? k - 4 : k);
    EXPECT_EQ(closed.points().col(k), open.points().col(leader[static_cast<std::size_t>(k)]));
  }
  EXPECT_EQ(close_exactly(open, {}), open);
}

TEST(Closure, CornersOfATorusHaveOneLeader) {
  const std::vector<int> leader = seam_leaders(ring(0), {true, true});
  for (const int corner : {0, 4, 15, 19}) EXPECT_EQ(leader[static_cast<std::size_t>(corner)], 0);
  for (const int k : leader) EXPECT_EQ(leader[static_cast<std::size_t>(k)], k);
}

TEST(Closure, APoleIsAnEdgeOfOnePoint) {
  NurbsSurface cone = ring(0);
  Eigen::Matrix3Xd points = cone.points();
  for (int k = 0; k < 5; ++k) points.col(k) << 0, 0, 0;
  cone = cone.with_points(points);
  EXPECT_TRUE(collapsed(cone, Direction::v, 0, 1e-9));
  EXPECT_FALSE(collapsed(cone, Direction::v, 1, 1e-9));
  EXPECT_FALSE(collapsed(cone, Direction::u, 0, 1e-9));
}

}  // namespace
}  // namespace toile
