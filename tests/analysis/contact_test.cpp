// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/contact_projection.h"
#include "analysis/parallel/workers.h"
#include "contact_scene.h"
#include "flat_cloth.h"
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
    for (const double dt : {5e-4, 2e-3}) {
      ContactSceneOptions o = incline(0, limit);
      ContactScene scene(o, one(PlaneShape{}, 0.3));
      EXPECT_TRUE(scene.run(dt, 0.3));
      EXPECT_NEAR(scene.force(0).z(), scene.weight(), 1e-3 * scene.weight()) << dt << " " << static_cast<int>(limit);
      EXPECT_LT(scene.state.v.lpNorm<Eigen::Infinity>(), 5e-3);
      EXPECT_LT(scene.depth(), 0.1 * o.half_thickness);
    }
}

TEST(Contact, FrictionHoldsBelowItsAngle) {
  for (const Limit limit : {Limit::none, Limit::law}) {
    ContactScene scene(incline(0.99 * 0.4, limit), one(PlaneShape{}, 0.4));
    scene.run(2e-3, 0.5);
    const Vector3d before = scene.mean();
    EXPECT_TRUE(scene.run(2e-3, 3));
    EXPECT_LT((scene.mean() - before).norm(), 1e-4) << static_cast<int>(limit);
  }
}

TEST(Contact, ClothSlidesAsCoulombSays) {
  const double friction = 0.4;
  for (const Limit limit : {Limit::none, Limit::law})
    for (const double over : {1.01, 1.25}) {
      const double tangent = over * friction;
      ContactScene scene(incline(tangent, limit), one(PlaneShape{}, friction));
      EXPECT_TRUE(scene.run(2e-3, 1));
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
    scene.run(2e-3, 0.5);
    // The cloth's thickness and what flat triangles leave out of the sphere. Substeps meet contact last in a step.
    const double bound = 0.1 * (2 * o.half_thickness + 0.17e-3);
    EXPECT_LT(scene.depth(), limit == Limit::law ? bound : 3 * bound);
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

// A rod thinner than the distance of the sampled points.
TEST(Contact, AThinRodCarriesCloth) {
  ContactSceneOptions o;
  o.size = 0.4;
  o.limit = Limit::none;
  o.fabric = soft(0.35);
  o.shift = {-0.21, -0.2, 0.004};
  ContactScene scene(o, one(CapsuleShape{{0, -0.3, 0}, {0, 0.3, 0}, 1e-3}, 0.8));
  scene.run(2e-3, 0.4);
  EXPECT_GT(scene.force(0).z(), 0.5 * scene.weight());
  EXPECT_LT(scene.depth(), 1e-4);
  EXPECT_LT(scene.at(0, 0.2).z(), -0.05);  // hangs over it
}

// One contact stops a sheet that may not stretch, at a vertex of it or between.
TEST(Contact, ANeedleDoesntPierce) {
  for (const Eigen::Vector2d& beside : {Eigen::Vector2d(0, 0), Eigen::Vector2d(3e-3, 4e-3)}) {
    ContactSceneOptions o;
    o.size = 0.4;
    o.spans = 12;
    o.fabric = soft(0.35);
    o.shift = {-0.2 + beside.x(), -0.2 + beside.y(), 0.01};
    o.velocity = {0, 0, -2.5};
    ContactScene scene(o, one(CapsuleShape{{0, 0, -0.5}, {0, 0, 0}, 1e-3}, 0.8));
    scene.run(1e-3, 0.06);
    // The cloth at the needle is where it was first met, not below.
    EXPECT_GT(scene.at(0.2 - beside.x(), 0.2 - beside.y()).z(), 0) << beside.transpose();
    EXPECT_LT(scene.mean().z(), -0.03);
  }
}

// The tip and the mantle of a slender cone.
TEST(Contact, AConeIsCoveredNotPierced) {
  ContactSceneOptions o;
  o.size = 0.4;
  o.spans = 12;
  o.fabric = soft(0.35);
  o.shift = {-0.197, -0.204, 0.105};
  ContactScene scene(o, one(ConeShape{{0, 0, -0.3}, {0, 0, 0.1}, 0.08}, 0.3));
  scene.run(1e-3, 0.4);
  EXPECT_GT(scene.above(0, 0).z(), 0.1);
  EXPECT_LT(scene.depth(), 1.5e-4);
  EXPECT_LT(scene.at(0, 0).z(), -0.05);
}

// Cloth that starts 20 mm inside is outside in a second, and is not thrown off.
TEST(Contact, AStartInsideIsPushedOutSlowly) {
  ContactSceneOptions o;
  o.fabric = soft(0.35);
  o.size = 0.4;
  o.shift = {-0.2, -0.2, 0.18};
  ContactScene scene(o, one(SphereShape{{0, 0, 0}, 0.2}, 0.3));
  EXPECT_GT(scene.depth(), 0.02);
  double highest = 0;
  for (int k = 0; k < 50; ++k) {
    scene.run(2e-3, scene.state.t + 2e-3);
    highest = std::max(highest, scene.at(0.2, 0.2).z());
  }
  EXPECT_LT(highest, 0.2 + 0.5e-3 + 2e-3);  // on the surface, with its chord error and the spring of stretched cloth
  const Vector3d lies = scene.at(0.2, 0.2);
  EXPECT_LT(scene.depth(), 3e-4);
  scene.run(2e-3, 0.6);
  EXPECT_LT((scene.at(0.2, 0.2) - lies).norm(), 1e-3);
  EXPECT_LT(scene.depth(), 3e-4);
}

// Impulses cancel, and without friction act along the normal at the end of the step, which turns within it: what they
// add to the spin falls with the step.
TEST(Contact, CollidingClothKeepsItsMomenta) {
  // A fold that closes: both halves move towards each other.
  const auto added = [](double dt) {
    ContactSceneOptions o;
    o.fabric = soft(0);
    o.fabric.friction = 0;
    o.spans = 12;
    o.gravity = {0, 0, 0};
    o.limit = Limit::none;
    o.contact.search.self = true;
    ContactScene scene(o, {});
    for (int k = 0; k < scene.map.nodes(); ++k) {
      auto x = scene.state.x.segment<3>(3 * k);
      const double s = x.x() - 0.2;
      x = Vector3d(0.2 + 0.05 * std::sin(std::clamp(s / 0.05, -1.5, 1.5)), x.y() + 0.1 * s * x.y(), 0);
      x.z() = 0.05 * (1 - std::cos(std::clamp(s / 0.05, -1.5, 1.5))) + std::max(0.0, std::abs(s) - 0.075);
      scene.state.v.segment<3>(3 * k) = Vector3d(s > 0.05 ? -2 : s < -0.05 ? 2 : 0, 0.1, 0);
    }
    initialise(scene.system, scene.state);
    const auto of = [&] { return momenta(scene.system.node_mass, scene.state.x, scene.state.v); };
    const Eigen::Matrix<double, 6, 1> before = of();
    int contacts = 0;
    while (scene.state.t < 0.05 - 0.5 * dt) {
      scene.run(dt, scene.state.t + dt);
      contacts += scene.last.projection.contacts;
    }
    EXPECT_GT(contacts, 100);
    return Eigen::Matrix<double, 6, 1>(of() - before);
  };
  const auto coarse = added(5e-4), fine = added(1.25e-4);
  for (const auto& more : {coarse, fine}) EXPECT_LT(more.head<3>().norm(), 1e-10);
  EXPECT_LT(coarse.tail<3>().norm(), 1e-6);  // kg m2/s, of 5e-4
  EXPECT_LT(fine.tail<3>().norm(), 0.5 * coarse.tail<3>().norm());
}

// A force far beyond its weight presses cloth into its offset, never through the surface, however long it lasts.
TEST(Contact, ALastingForceDoesntSinkIn) {
  for (const double times : {10.0, 300.0}) {
    ContactSceneOptions o = incline(0, Limit::law);
    o.gravity *= times;
    o.contact.acceleration = 9.81;
    ContactScene scene(o, one(BoxShape{{0.2, 0.2, -0.5}, {2, 2, 1}}, 0.3));
    scene.run(5e-5, 0.02);
    const double before = scene.mean().z();
    EXPECT_GT(before, 0.3 * o.half_thickness) << times;
    scene.run(5e-5, 0.06);
    EXPECT_NEAR(scene.mean().z(), before, 0.05 * o.half_thickness) << times;
  }
}

// A resume and threads give the same bits.
TEST(Contact, AResumeAndThreadsChangeNothing) {
  ContactSceneOptions o;
  o.fabric = soft(0.35);
  o.size = 0.6;
  o.spans = 12;
  o.shift = {-0.22, -0.3, 0.202};
  o.contact.search.self = true;
  const BoxShape box{{0, 0, 0}, {0.4, 0.4, 0.4}};
  ContactScene whole(o, one(box, 0.5)), stopped(o, one(box, 0.5)), threaded(o, one(box, 0.5));
  Workers workers(2);
  threaded.contact->use_threads(&workers);
  threaded.system.workers = &workers;
  whole.run(2e-3, 0.2);
  threaded.run(2e-3, 0.2);
  stopped.run(2e-3, 0.1);
  const ProjectionMemory memory = stopped.contact->memory();
  stopped.renew();
  EXPECT_TRUE(stopped.contact->restore(memory));
  stopped.run(2e-3, 0.2);
  EXPECT_EQ(whole.state.x, stopped.state.x);
  EXPECT_EQ(whole.state.v, stopped.state.v);
  EXPECT_EQ(whole.state.x, threaded.state.x);
}

}  // namespace
}  // namespace toile::test
