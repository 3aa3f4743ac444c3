// SPDX-License-Identifier: GPL-3.0-or-later
#include <limits>
#include <numbers>

#include "expect_error.h"
#include "geometry/measure.h"
#include "geometry/refine.h"
#include "random_geometry.h"
#include "support/near.h"

namespace toile {
namespace {

using test::Ends;
using test::Kind;

// Nearest sample and the distance within which the true minimum may undercut it.
struct BruteForce {
  double distance = std::numeric_limits<double>::infinity();
  double slack = 0;
};
BruteForce brute_force(const NurbsSurface& s, const Eigen::Vector3d& target) {
  BruteForce result;
  const auto us = test::spread(s.u().domain(), 241), vs = test::spread(s.v().domain(), 241);
  Eigen::Matrix3Xd last(3, us.size());
  for (std::size_t j = 0; j < vs.size(); ++j)
    for (std::size_t i = 0; i < us.size(); ++i) {
      const Eigen::Vector3d x = s(us[i], vs[j]);
      result.distance = std::min(result.distance, (x - target).norm());
      if (j > 0) result.slack = std::max(result.slack, (x - last.col(i)).norm());
      last.col(i) = x;
      if (i > 0) result.slack = std::max(result.slack, (x - last.col(i - 1)).norm());
    }
  return result;
}

TEST(ClosestPoint, IsNeverFartherThanBruteForceFinds) {
  SCOPED_TRACE("seed 91");
  test::Random random(91);
  for (int degree = 1; degree <= 4; ++degree)
    for (auto kind : {Kind::polynomial, Kind::rational})
      for (auto ends : {Ends::clamped, Ends::unclamped}) {
        const NurbsSurface s = test::random_surface(random, degree, degree, 3, ends, kind);
        const auto box = bounding_box(s);
        for (int trial = 0; trial < 6; ++trial) {
          Eigen::Vector3d target;
          for (int d = 0; d < 3; ++d) target[d] = random.real(box.min()[d] - 1, box.max()[d] + 1);
          const ClosestPoint found = closest_point(s, target);
          const BruteForce sampled = brute_force(s, target);
          EXPECT_TRUE(found.converged) << "residual " << found.residual << " degree " << degree;
          EXPECT_LE(found.distance, sampled.distance + 1e-12);
          EXPECT_GE(found.distance, sampled.distance - sampled.slack);
          EXPECT_LE(found.lower_bound, found.distance);
          EXPECT_GE(found.lower_bound, found.distance - 1.01e-7 * box.diagonal().norm());
          EXPECT_LT((s(found.u, found.v) - found.x).norm(), 1e-12 * box.diagonal().norm());
          expect_near_rel((found.x - target).norm(), found.distance, 1e-12);
        }
      }
}

TEST(ClosestPoint, InvertsPointsOfTheSurface) {
  SCOPED_TRACE("seed 92");
  test::Random random(92);
  for (auto kind : {Kind::polynomial, Kind::rational})
    for (int degree : {1, 2, 3}) {
      const NurbsSurface s = test::random_surface(random, degree, degree, 4, Ends::unclamped, kind);
      for (int trial = 0; trial < 40; ++trial) {
        const double u = random.real(s.u().domain().min, s.u().domain().max);
        const double v = random.real(s.v().domain().min, s.v().domain().max);
        const ClosestPoint found = closest_point(s, s(u, v));
        EXPECT_TRUE(found.converged);
        EXPECT_LT(found.distance, 1e-12 * test::size_of(s));
      }
    }
}

TEST(ClosestPoint, OnASphereLiesBelowTheTarget) {
  SCOPED_TRACE("seed 93");
  test::Random random(93);
  const NurbsSurface octant = test::sphere_octant();
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::Vector3d direction =
        Eigen::Vector3d(random.real(0, 1), random.real(0, 1), random.real(0, 1)).normalized();
    const double radius = random.real(0.3, 4);
    const ClosestPoint found = closest_point(octant, radius * direction);
    EXPECT_TRUE(found.converged) << found.residual;
    expect_near_rel(found.distance, std::abs(radius - 1), 1e-12, 1e-12);
    EXPECT_LT((found.x - direction).norm(), 1e-11 / std::min(1.0, radius));
  }
  const ClosestPoint centre = closest_point(octant, Eigen::Vector3d::Zero());
  EXPECT_TRUE(centre.converged);
  expect_near_rel(centre.distance, 1, 1e-14);
  expect_near_rel(centre.lower_bound, 1, 1e-3);  // every point is as near: the proof stops early and says so
  // At the pole the surface is singular, and below the equator the border is nearest.
  const ClosestPoint pole = closest_point(octant, Eigen::Vector3d(0, 0, 3));
  EXPECT_TRUE(pole.converged);
  EXPECT_LT((pole.x - Eigen::Vector3d(0, 0, 1)).norm(), 1e-12);
  const ClosestPoint border = closest_point(octant, Eigen::Vector3d(2, 2, -1));
  EXPECT_TRUE(border.converged);
  EXPECT_EQ(border.v, 0);
  EXPECT_LT((border.x - Eigen::Vector3d(1, 1, 0).normalized()).norm(), 1e-12);
}

TEST(ClosestPoint, StaysOnBordersAndCorners) {
  Eigen::Matrix3Xd corners(3, 4);
  corners << 0, 2, 0, 2, 0, 0, 1, 1, 0, 0, 0, 0;
  const NurbsSurface plate = refine({KnotVector(), KnotVector(), corners}, {.degree = 2, .spans = {{4, 3}}}).surface;
  for (double a : {-1.0, 0.0, 0.5, 2.0, 3.0})
    for (double b : {-2.0, 0.0, 0.3, 1.0, 5.0}) {
      const ClosestPoint found = closest_point(plate, Eigen::Vector3d(a, b, 0.7));
      EXPECT_TRUE(found.converged);
      const Eigen::Vector3d expected(std::clamp(a, 0.0, 2.0), std::clamp(b, 0.0, 1.0), 0);
      EXPECT_LT((found.x - expected).norm(), 1e-12);
      EXPECT_EQ(found.u == 0 || found.u == 1, a <= 0 || a >= 2);
      EXPECT_EQ(found.v == 0 || found.v == 1, b <= 0 || b >= 1);
    }
}

// Two plates that meet in a ridge at x = 1; z = 1 - |x - 1|.
NurbsSurface roof() {
  const KnotVector u(1, {0, 0, 0.5, 1, 1}), v;
  Eigen::Matrix3Xd points(3, 6);
  points << 0, 1, 2, 0, 1, 2, 0, 0, 0, 1, 1, 1, 0, 1, 0, 0, 1, 0;
  return {u, v, points};
}

TEST(ClosestPoint, FindsRidgesWhereTheSurfaceHasAFold) {
  for (const NurbsSurface& s : {roof(), elevate_degree(elevate_degree(roof(), Direction::u, 3), Direction::v, 2)})
    for (double x : {0.8, 1.0, 1.3}) {
      const ClosestPoint found = closest_point(s, Eigen::Vector3d(x, 0.4, 2.5));
      EXPECT_TRUE(found.converged);
      EXPECT_LT((found.x - Eigen::Vector3d(1, 0.4, 1)).norm(), 1e-12);
      EXPECT_EQ(found.u, 0.5);
    }
}

TEST(ClosestPoint, CrossesAFoldFromAGivenStart) {
  ClosestPointOptions options;
  options.start = Eigen::Vector2d(0.1, 0.2);
  const ClosestPoint found = closest_point(roof(), Eigen::Vector3d(1.75, 0.6, 0.75), options);
  EXPECT_TRUE(found.converged);
  EXPECT_LT((found.x - Eigen::Vector3d(1.5, 0.6, 0.5)).norm(), 1e-12);
}

TEST(ClosestPoint, SaysWhenItDidNotConverge) {
  ClosestPointOptions options;
  options.start = Eigen::Vector2d(0.9, 0.1);
  options.max_iterations = 1;
  const Eigen::Vector3d target(0.2, 0.8, 1.9);
  const ClosestPoint cut_short = closest_point(test::sphere_octant(), target, options);
  EXPECT_FALSE(cut_short.converged);
  EXPECT_GT(cut_short.residual, 1e-6);
  options.max_iterations = 60;
  EXPECT_TRUE(closest_point(test::sphere_octant(), target, options).converged);
  test::expect_geometry_error([] { closest_point(NurbsSurface(), Eigen::Vector3d(0, std::nan(""), 0)); }, "target",
                              "not finite");
}

template <class Dim>
class CurveClosest : public ::testing::Test {};
using Dims = ::testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(CurveClosest, Dims);

TYPED_TEST(CurveClosest, IsNeverFartherThanBruteForceFinds) {
  constexpr int dim = TypeParam::value;
  SCOPED_TRACE("seed 94");
  test::Random random(94);
  for (int degree = 1; degree <= 5; ++degree)
    for (auto kind : {Kind::polynomial, Kind::rational}) {
      const auto curve = test::random_curve<dim>(random, degree, 5, Ends::unclamped, kind);
      const auto box = bounding_box(curve);
      for (int trial = 0; trial < 20; ++trial) {
        Eigen::Matrix<double, dim, 1> target;
        for (int d = 0; d < dim; ++d) target[d] = random.real(box.min()[d] - 1, box.max()[d] + 1);
        const auto found = closest_point(curve, target);
        EXPECT_TRUE(found.converged) << found.residual;
        double nearest = std::numeric_limits<double>::infinity(), slack = 0;
        Eigen::Matrix<double, dim, 1> last = curve.start();
        for (double t : test::spread(curve.domain(), 4001)) {
          const auto x = curve(t);
          nearest = std::min(nearest, (x - target).norm());
          slack = std::max(slack, (x - last).norm());
          last = x;
        }
        EXPECT_LE(found.distance, nearest + 1e-12);
        EXPECT_GE(found.distance, nearest - slack);
        EXPECT_LT((curve(found.t) - found.x).norm(), 1e-12 * box.diagonal().norm());
      }
    }
}

TEST(CurveClosestPoint, OnACircleLiesOnTheRay) {
  SCOPED_TRACE("seed 95");
  test::Random random(95);
  const Curve2 circle = circular_arc({1, 2}, 3, 0, 2 * std::numbers::pi);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Vector2d r(random.real(-9, 9), random.real(-9, 9));
    const auto found = closest_point(circle, Eigen::Vector2d(Eigen::Vector2d(1, 2) + r));
    EXPECT_TRUE(found.converged);
    expect_near_rel(found.distance, std::abs(r.norm() - 3), 1e-11, 1e-12);
  }
  // The centre is as near to every point.
  const auto centre = closest_point(circle, Eigen::Vector2d(1, 2));
  EXPECT_TRUE(centre.converged);
  expect_near_rel(centre.distance, 3, 1e-14);
  expect_near_rel(centre.lower_bound, 3, 1e-5);
}

}  // namespace
}  // namespace toile
