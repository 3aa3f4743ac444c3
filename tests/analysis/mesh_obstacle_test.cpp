// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/mesh_obstacle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <set>

#include "geometry/error.h"
#include "geometry/mesh_repair.h"
#include "geometry/triangle.h"
#include "support/bodies.h"
#include "support/near.h"

namespace toile {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using test::ball_mesh;
using test::box_mesh;
using test::sphere_mesh;
using test::spiky_mesh;
using test::torus_mesh;

constexpr double infinite = std::numeric_limits<double>::infinity();

class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}
  double operator()(double least, double most) { return std::uniform_real_distribution(least, most)(random_); }
  int index(std::size_t count) { return static_cast<int>(random_() % count); }
  Vector3d place(double size) { return {(*this)(-size, size), (*this)(-size, size), (*this)(-size, size)}; }

 private:
  std::mt19937 random_;
};

std::map<std::string, TriangleMesh> bodies() {
  return {{"box", box_mesh({0.3, 0.5, 0.2})},
          {"sphere", sphere_mesh(12, 0.5)},
          {"torus", torus_mesh(24, 12, 0.5, 0.2)},
          {"spiky", spiky_mesh(24)}};
}

// Near vertices and edges too, where the nearest face alone tells the wrong side.
std::vector<Vector3d> places(const TriangleMesh& mesh, Random& random) {
  std::vector<Vector3d> out;
  for (int k = 0; k < 300; ++k) out.push_back(random.place(0.9));
  for (int k = 0; k < 300; ++k) {
    const Triangle& t = mesh.triangles[random.index(mesh.triangles.size())];
    const Vector3d a = mesh.vertices.col(t[0]), b = mesh.vertices.col(t[1]);
    out.push_back(a + (k % 2 == 0 ? 0 : random(0, 1)) * (b - a) + random.place(k % 3 == 0 ? 1e-4 : 0.02));
  }
  return out;
}

MeshObstacle obstacle(const TriangleMesh& mesh, MeshMotion motion = {}) {
  return MeshObstacle(mesh, std::move(motion), {.name = "body"});
}

TEST(MeshObstacle, TheSignIsThatOfTheWindingNumber) {
  Random random(11);
  for (const auto& [name, mesh] : bodies()) {
    SCOPED_TRACE(name);
    const MeshObstacle body = obstacle(mesh);
    EXPECT_TRUE(body.closed());
    int inside = 0;
    for (const Vector3d& p : places(mesh, random)) {
      const auto found = body.nearest(p, infinite);
      ASSERT_TRUE(found);
      const double winding = winding_number(mesh.vertices, mesh.triangles, p);
      if (std::abs(found->distance) < 1e-12) continue;
      EXPECT_EQ(found->distance<0, winding> 0.5) << p.transpose() << ": " << found->distance << ", " << winding;
      inside += winding > 0.5;
    }
    EXPECT_GT(inside, 50);
  }
}

TEST(MeshObstacle, NoPointOfAnyTriangleIsNearer) {
  Random random(13);
  for (const auto& [name, mesh] : bodies()) {
    SCOPED_TRACE(name);
    const MeshObstacle body = obstacle(mesh);
    for (const Vector3d& p : places(mesh, random)) {
      double least = infinite;
      for (const Triangle& t : mesh.triangles)
        least = std::min(
            least,
            (closest_on_triangle(mesh.vertices.col(t[0]), mesh.vertices.col(t[1]), mesh.vertices.col(t[2]), p).point -
             p)
                .norm());
      const auto found = body.nearest(p, 0.2);
      ASSERT_EQ(found.has_value(), least <= 0.2);
      if (!found) continue;
      EXPECT_NEAR(std::abs(found->distance), least, 1e-15);
      EXPECT_NEAR(found->normal.norm(), 1, 1e-14);
      // The normal leads from the surface to the place.
      EXPECT_LT((found->point + found->distance * found->normal - p).norm(), 1e-14 + 1e-6 * least);
    }
  }
}

TEST(MeshObstacle, EveryFaceEdgeAndVertexIsAFeatureOfItsOwn) {
  const TriangleMesh box = box_mesh({0.5, 0.5, 0.5});
  const MeshObstacle body = obstacle(box);
  std::set<int> features;
  for (int x : {-1, 0, 1})
    for (int y : {-1, 0, 1})
      for (int z : {-1, 0, 1}) {
        if (x == 0 && y == 0 && z == 0) continue;
        // Off the faces' diagonals, which are edges too.
        const Vector3d p(x + 0.01, y + 0.02, z - 0.03);
        const auto found = body.nearest(p, infinite);
        ASSERT_TRUE(found);
        features.insert(found->feature);
        EXPECT_EQ(body.nearest(p + Vector3d::Constant(1e-3), infinite)->feature, found->feature);
      }
  EXPECT_EQ(features.size(), 26u);  // 6 faces, 12 edges, 8 vertices
}

TEST(MeshObstacle, ConvexEdgesOver25DegreesAreSharp) {
  EXPECT_EQ(obstacle(box_mesh({1, 1, 1})).sharp_edges().size(), 12u);  // not the diagonals
  EXPECT_EQ(obstacle(box_mesh({1, 1, 1})).sharp_vertices().size(), 8u);
  // Of a cylinder with n sides two neighbours meet at 360/n degrees.
  const auto prism = [](int n) {
    TriangleMesh mesh;
    mesh.vertices.resize(3, 2 * n + 2);
    for (int k = 0; k < n; ++k) {
      const double phi = 2 * std::numbers::pi * k / n;
      mesh.vertices.col(k) << std::cos(phi), std::sin(phi), 0;
      mesh.vertices.col(n + k) << std::cos(phi), std::sin(phi), 1;
      const int l = (k + 1) % n;
      mesh.triangles.insert(mesh.triangles.end(), {{k, l, n + l}, {k, n + l, n + k}, {l, k, 2 * n}});
      mesh.triangles.push_back({n + k, n + l, 2 * n + 1});
    }
    mesh.vertices.col(2 * n) << 0, 0, 0;
    mesh.vertices.col(2 * n + 1) << 0, 0, 1;
    return mesh;
  };
  EXPECT_EQ(obstacle(prism(14)).sharp_edges().size(), 14u + 28u);  // 25.7 degrees
  EXPECT_EQ(obstacle(prism(15)).sharp_edges().size(), 30u);        // 24 degrees
  // A dent is no sharp tip, and its edges are seen from inside.
  TriangleMesh dent = prism(14);
  dent.vertices.col(29) << 0, 0, 0.3;
  const MeshObstacle dented = obstacle(dent);
  for (const Segment& edge : dented.sharp_edges())
    EXPECT_GT(std::min(edge.from.head<2>().norm(), edge.to.head<2>().norm()), 0.9);
  EXPECT_EQ(dented.sharp_vertices().size(), 28u);
}

TEST(MeshObstacle, TheTipOfAFineConeIsSharp) {
  const int n = 60;
  TriangleMesh cone;
  cone.vertices.resize(3, n + 2);
  for (int k = 0; k < n; ++k) {
    const double phi = 2 * std::numbers::pi * k / n;
    cone.vertices.col(k) << 0.3 * std::cos(phi), 0.3 * std::sin(phi), 0;
    cone.triangles.push_back({k, (k + 1) % n, n});
    cone.triangles.push_back({(k + 1) % n, k, n + 1});
  }
  cone.vertices.col(n) << 0, 0, 1;
  cone.vertices.col(n + 1) << 0, 0, 0;
  const MeshObstacle body = obstacle(cone);
  EXPECT_EQ(body.sharp_edges().size(), 60u);     // around the base
  EXPECT_EQ(body.sharp_vertices().size(), 61u);  // and the tip
  EXPECT_TRUE(obstacle(sphere_mesh(12, 1)).sharp_vertices().empty());
}

TEST(MeshObstacle, ASurfaceWithABorderHasTwoSides) {
  TriangleMesh square;
  square.vertices.resize(3, 4);
  square.vertices << 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0;
  square.triangles = {{0, 1, 2}, {0, 2, 3}};
  const MeshObstacle body = obstacle(square);
  EXPECT_FALSE(body.closed());
  EXPECT_EQ(body.sharp_edges().size(), 4u);
  EXPECT_EQ(body.sharp_vertices().size(), 4u);
  EXPECT_DOUBLE_EQ(body.nearest({0.3, 0.6, 0.2}, 1)->distance, 0.2);
  EXPECT_DOUBLE_EQ(body.nearest({0.3, 0.6, -0.2}, 1)->distance, -0.2);
  EXPECT_EQ(body.nearest({0.3, 0.6, -0.2}, 1)->normal, Vector3d(0, 0, 1));
  EXPECT_DOUBLE_EQ(body.nearest({1.3, 0.5, -0.4}, 1)->distance, -0.5);
}

// A turn about an axis that goes through no special place, and a way.
Isometry3d turned(double t) {
  Isometry3d out = Isometry3d::Identity();
  out.rotate(Eigen::AngleAxisd(2 * t, Vector3d(1, 2, -1).normalized()));
  out.pretranslate(Vector3d(0.3 * t, -0.1, t * t));
  return out;
}

TEST(MeshObstacle, ARigidMotionTakesEverythingAlong) {
  Random random(17);
  for (const auto& [name, mesh] : bodies()) {
    SCOPED_TRACE(name);
    const MeshObstacle still = obstacle(mesh);
    MeshObstacle body = obstacle(mesh, {.place = turned});
    EXPECT_TRUE(still.still());
    EXPECT_FALSE(body.still());
    body.move(0.4, 0.7);
    ASSERT_EQ(body.sharp_edges().size(), still.sharp_edges().size());
    for (std::size_t k = 0; k < still.sharp_edges().size(); ++k)
      EXPECT_LT((body.sharp_edges()[k].to - turned(0.7) * still.sharp_edges()[k].to).norm(), 1e-14);
    for (const Vector3d& p : places(mesh, random)) {
      const auto here = still.nearest(p, infinite), there = body.nearest(turned(0.7) * p, infinite);
      ASSERT_TRUE(here && there);
      EXPECT_NEAR(here->distance, there->distance, 1e-13);
      EXPECT_LT((turned(0.7) * here->point - there->point).norm(), 1e-13);
      EXPECT_LT((body.carry(turned(0.4) * p, here->feature) - turned(0.7) * p).norm(), 1e-14);
    }
  }
}

// The same motion told as shapes: places go with the triangle at their feature.
TEST(MeshObstacle, CarryIsExactWhereShapesMoveRigidly) {
  Random random(19);
  for (const auto& [name, mesh] : bodies()) {
    SCOPED_TRACE(name);
    MeshMotion motion{.times = {0.4, 0.7}};
    for (const double t : motion.times) {
      Eigen::Matrix3Xd shape = mesh.vertices;
      for (Eigen::Index k = 0; k < shape.cols(); ++k) shape.col(k) = turned(t) * shape.col(k);
      motion.shapes.push_back(shape);
    }
    MeshObstacle body = obstacle(mesh, motion);
    body.move(0.4, 0.7);
    for (const Vector3d& p : places(mesh, random)) {
      const int feature = body.nearest(turned(0.7) * p, infinite)->feature;
      EXPECT_LT((body.carry(turned(0.4) * p, feature) - turned(0.7) * p).norm(), 1e-12);
    }
  }
}

TEST(MeshObstacle, ShapesFollowEachOtherInProportionToTime) {
  const TriangleMesh small = sphere_mesh(10, 0.25), large = sphere_mesh(10, 0.5);
  MeshObstacle body = obstacle(small, {.shapes = {small.vertices, large.vertices}, .times = {1, 3}});
  const Vector3d along = Vector3d(small.vertices.col(33)).normalized();
  const auto radius = [&](double before, double now) {
    body.move(before, now);
    return 1 - body.nearest(along, infinite)->distance;
  };
  EXPECT_DOUBLE_EQ(radius(0, 0.5), 0.25);
  EXPECT_DOUBLE_EQ(radius(0.5, 1), 0.25);
  EXPECT_DOUBLE_EQ(radius(1, 1.5), 0.3125);
  EXPECT_DOUBLE_EQ(radius(1.5, 3), 0.5);
  EXPECT_DOUBLE_EQ(radius(3, 9), 0.5);
  EXPECT_DOUBLE_EQ(radius(9, 2), 0.375);  // a step that is done again
  // A place keeps its distance from the triangle that it goes with, and its share of it.
  body.move(1, 3);
  const Vector3d on = small.vertices.col(33);
  EXPECT_LT((body.carry(on, body.nearest(along, infinite)->feature) - 2 * on).norm(), 1e-15);
  const Triangle& t = small.triangles[40];
  const Vector3d centre = (small.vertices.col(t[0]) + small.vertices.col(t[1]) + small.vertices.col(t[2])) / 3;
  const auto near = body.nearest(2.1 * centre, infinite);
  EXPECT_LT((body.carry(centre + 0.01 * near->normal, near->feature) - 2 * centre - 0.01 * near->normal).norm(), 1e-15);
  // Smooth: after a tenth of the time a hundredth of the way.
  MeshObstacle smooth = obstacle(small, {.shapes = {small.vertices, large.vertices}, .times = {1, 3}, .smooth = true});
  smooth.move(1, 1.2);
  const double s = 0.1, share = 10 * std::pow(s, 3) - 15 * std::pow(s, 4) + 6 * std::pow(s, 5);
  EXPECT_NEAR(1 - smooth.nearest(along, infinite)->distance, 0.25 * (1 + share), 1e-15);
}

// Features and sharp edges are those of the present shape, and the sign too.
TEST(MeshObstacle, AShapeThatChangesIsAsGoodAsOneThatIs) {
  Random random(23);
  const TriangleMesh ball = sphere_mesh(24, 0.5), spiky = spiky_mesh(24);
  MeshObstacle body = obstacle(ball, {.place = turned, .shapes = {ball.vertices, spiky.vertices}, .times = {0, 1}});
  body.move(0.9, 1);
  TriangleMesh placed = spiky;
  for (Eigen::Index k = 0; k < placed.vertices.cols(); ++k) placed.vertices.col(k) = turned(1) * spiky.vertices.col(k);
  const MeshObstacle should = obstacle(placed);
  EXPECT_EQ(body.sharp_edges().size(), should.sharp_edges().size());
  for (const Vector3d& p : places(placed, random)) {
    const auto a = body.nearest(p, infinite), b = should.nearest(p, infinite);
    EXPECT_NEAR(a->distance, b->distance, 1e-13);
  }
}

TEST(MeshObstacle, RefusesWhatIsNoSurface) {
  const TriangleMesh good = box_mesh({1, 1, 1});
  const auto expect_refused = [](const TriangleMesh& mesh, const MeshMotion& motion = {}) {
    EXPECT_THROW(obstacle(mesh, motion), GeometryError);
  };
  expect_refused({});
  TriangleMesh bad = good;
  bad.vertices(1, 3) = std::numeric_limits<double>::quiet_NaN();
  expect_refused(bad);
  bad = good;
  bad.triangles[0] = {0, 2, 8};
  expect_refused(bad);
  bad = good;
  std::swap(bad.triangles[5][0], bad.triangles[5][1]);
  expect_refused(bad);
  bad = good;
  bad.triangles.push_back({0, 1, 7});
  expect_refused(bad);
  bad = good;
  bad.vertices.col(1) = 0.5 * (bad.vertices.col(0) + bad.vertices.col(2));
  expect_refused(bad);
  expect_refused(good, {.shapes = {good.vertices}, .times = {}});
  expect_refused(good, {.shapes = {good.vertices, good.vertices}, .times = {1, 1}});
  expect_refused(good, {.shapes = {good.vertices.leftCols(7)}, .times = {1}});
  expect_refused(good, {.shapes = {bad.vertices * std::numeric_limits<double>::infinity()}, .times = {1}});
  MeshObstacle body = obstacle(good, {.place = turned});
  EXPECT_THROW(body.move(0, infinite), GeometryError);
}

}  // namespace
}  // namespace toile
