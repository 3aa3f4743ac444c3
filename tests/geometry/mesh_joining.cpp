// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/mesh_joining.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "geometry/error.h"
#include "geometry/mesh_repair.h"
#include "support/bodies.h"

namespace toile {
namespace {

using Eigen::Vector3d;

// A patch of a cylinder around z, counter-clockwise from the outside: n x m quads.
void add_patch(TriangleMesh& mesh, double from, double to, double low, double high, int n, int m) {
  const int first = static_cast<int>(mesh.vertices.cols());
  mesh.vertices.conservativeResize(3, first + (n + 1) * (m + 1));
  for (int j = 0; j <= m; ++j)
    for (int i = 0; i <= n; ++i) {
      const double phi = from + (to - from) * i / n;
      mesh.vertices.col(first + i + (n + 1) * j) << std::cos(phi), std::sin(phi), low + (high - low) * j / m;
    }
  for (int j = 0; j < m; ++j)
    for (int i = 0; i < n; ++i) {
      const int a = first + i + (n + 1) * j, b = a + 1, c = a + n + 1, d = c + 1;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
}

// A disc at height z, facing up or down, with n corners and a vertex in its middle.
void add_disc(TriangleMesh& mesh, double z, int n, bool up) {
  const int first = static_cast<int>(mesh.vertices.cols());
  mesh.vertices.conservativeResize(3, first + n + 1);
  for (int k = 0; k < n; ++k) {
    const double phi = 2 * std::numbers::pi * k / n + 0.1;
    mesh.vertices.col(first + k) << std::cos(phi), std::sin(phi), z;
    const int l = (k + 1) % n;
    if (up)
      mesh.triangles.push_back({first + k, first + l, first + n});
    else
      mesh.triangles.push_back({first + l, first + k, first + n});
  }
  mesh.vertices.col(first + n) << 0, 0, z;
}

// Two half shells of two heights each, one patch that closes on itself, two lids: no two have the same points.
TEST(MeshJoining, PatchesWithDifferentPointsAlongTheirEdgesBecomeAClosedBody) {
  constexpr double pi = std::numbers::pi;
  TriangleMesh patches;
  add_patch(patches, 0, pi, 0, 1, 60, 3);
  add_patch(patches, pi, 2 * pi, 0, 1, 71, 4);
  add_patch(patches, 0.3, 0.3 + 2 * pi, 1, 2, 90, 5);
  add_disc(patches, 0, 83, false);
  add_disc(patches, 2, 101, true);
  EXPECT_FALSE(repair_mesh(patches).closed);
  const double sagitta = 1 - std::cos(pi / 71);  // 1 mm, of the coarsest
  const RepairedMesh body = repair_mesh(join_borders(patches, 2 * sagitta));
  EXPECT_TRUE(body.closed) << body.warnings[0];
  EXPECT_NEAR(test::volume(body.mesh), 2 * pi, 2 * pi * 2 * sagitta);
  for (Eigen::Index k = 0; k < body.mesh.vertices.cols(); ++k)
    EXPECT_LT(std::abs(std::hypot(body.mesh.vertices(0, k), body.mesh.vertices(1, k)) - 1) *
                  body.mesh.vertices.col(k).head<2>().norm(),
              1e-12);
}

TEST(MeshJoining, BordersFartherApartStayBorders) {
  TriangleMesh two;
  add_patch(two, 0, 1, 0, 1, 10, 1);
  add_patch(two, 0, 1, 1.01, 2, 7, 1);
  const TriangleMesh joined = join_borders(two, 0.005);
  EXPECT_EQ(joined.triangles, two.triangles);
  EXPECT_EQ(repair_mesh(joined).mesh.vertices.cols(), two.vertices.cols());
}

TEST(MeshJoining, NumbersMustBeFinite) {
  TriangleMesh two;
  add_patch(two, 0, 1, 0, 1, 10, 1);
  EXPECT_THROW(join_borders(two, std::nan("")), GeometryError);
  two.vertices(1, 3) = std::nan("");
  EXPECT_THROW(join_borders(two, 0.005), GeometryError);
}

}  // namespace
}  // namespace toile
