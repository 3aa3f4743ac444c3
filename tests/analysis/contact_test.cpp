// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/contact_projection.h"
#include "contact_scene.h"
#include "support/near.h"

namespace toile::test {
namespace {

using Eigen::Vector3d;

// Soft in bending, so that steps of milliseconds are stable.
Fabric soft(double drag) {
  Fabric fabric;
  fabric.bending.b0 = 1e-5;
  fabric.drag = drag;
  return fabric;
}

// Gravity as on a plane z = 0 that is tilted so that the cloth is drawn along x.
Vector3d tilted(double tangent) {
  return 9.81 * Vector3d(tangent, 0, -1).normalized();
}

ContactSceneOptions incline(double tangent, Limit limit) {
  ContactSceneOptions o;
  o.limit = limit;
  o.fabric = soft(0);
  o.gravity = tilted(tangent);
  o.shift = {0, 0, 0.5e-3};
  return o;
}

TEST(Contact, ClothAtRestPressesByItsWeight) {
  for (const Limit limit : {Limit::none, Limit::law, Limit::substeps})
    for (const double dt : {1e-3, 4e-3}) {
      ContactSceneOptions o = incline(0, limit);
      ContactScene scene(o, one(PlaneShape{}, 0.3));
      EXPECT_TRUE(scene.run(dt, 0.4));
      EXPECT_NEAR(scene.force(0).z(), scene.weight(), 1e-3 * scene.weight()) << dt << " " << static_cast<int>(limit);
      EXPECT_LT(scene.state.v.lpNorm<Eigen::Infinity>(), 1e-4);
      EXPECT_LT(scene.depth(), 0.1 * o.half_thickness);
    }
}

TEST(Contact, FrictionHoldsBelowItsAngle) {
  for (const Limit limit : {Limit::none, Limit::law}) {
    ContactScene scene(incline(0.99 * 0.4, limit), one(PlaneShape{}, 0.4));
    scene.run(5e-3, 0.5);
    const Vector3d before = scene.mean();
    EXPECT_TRUE(scene.run(5e-3, 3));
    EXPECT_LT((scene.mean() - before).norm(), 1e-4) << static_cast<int>(limit);
  }
}

TEST(Contact, ClothSlidesAsCoulombSays) {
  const double friction = 0.4;
  for (const Limit limit : {Limit::none, Limit::law})
    for (const double over : {1.01, 1.25}) {
      const double tangent = over * friction;
      ContactScene scene(incline(tangent, limit), one(PlaneShape{}, friction));
      EXPECT_TRUE(scene.run(5e-3, 1));
      const double a = 9.81 * (tangent - friction) / std::hypot(1, tangent);
      EXPECT_NEAR(scene.mean().x() - 0.2, 0.5 * a, 1e-3 * 0.5 * a) << over << " " << static_cast<int>(limit);
    }
}

TEST(Contact, ClothOnASphereKeepsOut) {
  for (const Limit limit : {Limit::law, Limit::substeps}) {
    ContactSceneOptions o;
    o.size = 0.8;
    o.spans = 16;
    o.limit = limit;
    o.fabric = soft(0.35);
    o.shift = {-0.4, -0.4, 0.205};
    ContactScene scene(o, one(SphereShape{{0, 0, 0}, 0.2}, 0.5));
    scene.run(3e-3, 0.3);
    // Half the cloth's thickness and what flat triangles leave out: 0.5 mm and 0.17 mm.
    EXPECT_LT(scene.depth(), 0.1 * (2 * o.half_thickness + 0.17e-3) + 1e-4) << static_cast<int>(limit);
  }
}

TEST(Contact, ABoxEdgeIsMetBetweenVertices) {
  ContactSceneOptions o;
  o.size = 0.6;
  o.spans = 12;
  o.limit = Limit::none;
  o.fabric = soft(0.35);
  o.shift = {-0.22, -0.3, 0.202};
  ContactScene scene(o, one(BoxShape{{0, 0, 0}, {0.4, 0.4, 0.4}}, 0.8));
  scene.run(3e-3, 0.4);
  EXPECT_LT(scene.depth(), 1e-4);
}

TEST(Contact, ADropAtTenMetresASecondStaysOnAThinPlate) {
  ContactSceneOptions o;
  o.fabric = soft(0.35);
  o.shift = {0, 0, 0.2};
  o.velocity = {0, 0, -10};
  ContactScene scene(o, one(BoxShape{{0.2, 0.2, 0}, {1, 1, 1e-3}}, 0.3));
  scene.run(4e-3, 0.4);
  double lowest = 1;
  for (int k = 0; k <= 10; ++k)
    for (int l = 0; l <= 10; ++l) lowest = std::min(lowest, scene.at(0.1 * k * 0.4, 0.1 * l * 0.4).z());
  EXPECT_GT(lowest, 0.5e-3);
}

}  // namespace
}  // namespace toile::test
