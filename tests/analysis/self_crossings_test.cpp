// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/self_crossings.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/bodies.h"

namespace toile {
namespace {

using Eigen::Vector3d;

TriangleMesh two(const TriangleMesh& a, const TriangleMesh& b, const Vector3d& shift) {
  TriangleMesh out = a;
  const int first = static_cast<int>(a.vertices.cols());
  out.vertices.conservativeResize(3, first + b.vertices.cols());
  out.vertices.rightCols(b.vertices.cols()) = b.vertices.colwise() + shift;
  for (const Triangle& t : b.triangles) out.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return out;
}

TEST(SelfCrossings, SoundMeshesHaveNone) {
  for (const TriangleMesh& mesh : {test::box_mesh({1, 1, 1}), test::torus_mesh(40, 20, 1, 0.4), test::spiky_mesh(30)})
    EXPECT_TRUE(self_crossings(mesh).empty());
  // Apart, and touching in a face, an edge and a corner.
  const TriangleMesh box = test::box_mesh({1, 1, 1});
  for (const Vector3d& shift : {Vector3d(3, 0, 0), Vector3d(2, 0.3, 0), Vector3d(2, 2, 0), Vector3d(2, 2, 2)})
    EXPECT_TRUE(self_crossings(two(box, box, shift)).empty());
}

// The two balls meet in a circle of radius 0.8 in the plane x = 0.6.
TEST(SelfCrossings, OfTwoBallsLieWhereTheyMeet) {
  const TriangleMesh ball = test::sphere_mesh(40, 1);
  const auto found = self_crossings(two(ball, ball, Vector3d(1.2, 0, 0)));
  EXPECT_GT(found.size(), 60u);
  for (const SelfCrossing& crossing : found) {
    EXPECT_LT(crossing.a, crossing.b);
    EXPECT_NEAR(crossing.place.x(), 0.6, 0.01);
    EXPECT_NEAR(crossing.place.tail<2>().norm(), 0.8, 0.01);
  }
}

TEST(SelfCrossings, NeighboursAtACornerMayCrossToo) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 5);
  mesh.vertices << 0, 2, 2, 1, 1,  //
      0, 1, -1, 0, 0,              //
      0, 0, 0, 1, -1;
  mesh.triangles = {{0, 1, 2}, {0, 3, 4}};
  const auto found = self_crossings(mesh);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_LT((found[0].place - Vector3d(1, 0, 0)).norm(), 1e-15);
}

}  // namespace
}  // namespace toile
