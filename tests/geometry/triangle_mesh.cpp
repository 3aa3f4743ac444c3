// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/triangle_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "geometry/error.h"
#include "geometry/triangle.h"
#include "support/bodies.h"

namespace toile {
namespace {

using Eigen::Vector3d;

// No point of a fine grid on the triangle is nearer, and the point lies in the part that is named.
TEST(Triangle, NoPointOfItIsNearerThanTheClosest) {
  std::mt19937 engine(5);
  const auto random = [&] { return std::uniform_real_distribution(-1.0, 1.0)(engine); };
  std::array<int, 7> parts{};
  for (int round = 0; round < 3000; ++round) {
    std::array<Vector3d, 3> x;
    for (Vector3d& corner : x) corner = {random(), random(), random()};
    if (round % 5 == 0) x[2] = x[0] + random() * (x[1] - x[0]);  // on one line
    if (round % 7 == 0) x[round % 3] = x[(round + 1) % 3];       // two in one place
    if (round % 35 == 0) x[1] = x[2] = x[0];
    const Vector3d p = round % 11 == 0 ? x[round % 3] : Vector3d(2 * random(), 2 * random(), 2 * random());
    const TrianglePoint found = closest_on_triangle(x[0], x[1], x[2], p);
    ASSERT_TRUE(found.point.allFinite());
    const double distance = (found.point - p).norm();
    constexpr int n = 20;
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j) {
        const Vector3d q = (i * x[0] + j * x[1] + (n - i - j) * x[2]) / n;
        ASSERT_LE(distance, (q - p).norm() + 1e-14) << round;
      }
    const auto off_line = [&](const Vector3d& a, const Vector3d& b) {
      const double length = (b - a).norm();
      return (found.point - a).norm() + (found.point - b).norm() - length;
    };
    ++parts[found.part];
    if (found.part >= 4) {
      EXPECT_EQ(found.point, x[found.part - 4]);
    } else if (found.part >= 1) {
      EXPECT_LT(off_line(x[found.part - 1], x[found.part % 3]), 1e-14);
    } else {
      EXPECT_LT(std::abs((x[1] - x[0]).dot(p - found.point)), 1e-12);
    }
  }
  for (const int count : parts) EXPECT_GT(count, 50);
}

TEST(MeshTopology, OfAClosedMeshEveryEdgeHasTwoFacesThatRunOppositeWays) {
  for (const TriangleMesh& mesh :
       {test::box_mesh({1, 1, 1}), test::torus_mesh(7, 5, 1, 0.3), test::sphere_mesh(6, 1)}) {
    const MeshTopology topology(mesh.triangles, static_cast<int>(mesh.vertices.cols()));
    const int faces = static_cast<int>(mesh.triangles.size());
    EXPECT_EQ(2 * topology.edge_count(), 3 * faces);
    for (int e = 0; e < topology.edge_count(); ++e) {
      const auto around = topology.faces_of_edge(e);
      ASSERT_EQ(around.size(), 2u);
      EXPECT_NE(topology.runs_along(around[0], e), topology.runs_along(around[1], e));
      EXPECT_LT(topology.edge(e)[0], topology.edge(e)[1]);
    }
    for (int f = 0; f < faces; ++f)
      for (int k = 0; k < 3; ++k) {
        const auto [a, b] = topology.edge(topology.edges_of_face(f)[k]);
        const int v = mesh.triangles[f][k], w = mesh.triangles[f][(k + 1) % 3];
        EXPECT_EQ(std::minmax(a, b), std::minmax(v, w));
        EXPECT_TRUE(std::ranges::count(topology.faces_of_vertex(v), f) == 1);
      }
    int parts = 0;
    connected_parts(topology, faces, parts);
    EXPECT_EQ(parts, 1);
  }
  const std::vector<Triangle> apart{{0, 1, 2}, {3, 4, 5}, {2, 1, 6}};
  int parts = 0;
  EXPECT_EQ(connected_parts(MeshTopology(apart, 7), 3, parts), (std::vector{0, 1, 0}));
  EXPECT_EQ(parts, 2);
}

TEST(MeshTopology, RefusesVerticesThatAreNotThereOrTwice) {
  for (const Triangle& bad : {Triangle{0, 1, 3}, Triangle{0, -1, 2}, Triangle{1, 1, 2}})
    EXPECT_THROW(MeshTopology(std::span(&bad, 1), 3), GeometryError);
}

}  // namespace
}  // namespace toile
