// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/measure.h"

#include <numbers>

#include "geometry/refine.h"
#include "random_geometry.h"
#include "support/near.h"

namespace toile {
namespace {

using test::Ends;
using test::Kind;

TEST(BoundingBox, HoldsTheGeometry) {
  SCOPED_TRACE("seed 81");
  test::Random random(81);
  for (int degree = 1; degree <= 4; ++degree) {
    const NurbsSurface s = test::random_surface(random, degree, degree, 3, Ends::unclamped, Kind::rational);
    const auto box = bounding_box(s);
    const Eigen::AlignedBox3d grown(box.min().array() - 1e-13, box.max().array() + 1e-13);
    for (double u : test::spread(s.u().domain(), 20))
      for (double v : test::spread(s.v().domain(), 20)) EXPECT_TRUE(grown.contains(s(u, v)));
    const Curve2 c = test::random_curve<2>(random, degree, 3, Ends::unclamped, Kind::rational);
    for (double t : test::spread(c.domain(), 50)) EXPECT_LT(bounding_box(c).exteriorDistance(c(t)), 1e-13);
  }
}

TEST(SurfaceArea, MatchesClosedForms) {
  constexpr double pi = std::numbers::pi;
  expect_near_rel(surface_area(test::sphere_octant()), pi / 2, 1e-10);
  expect_near_rel(surface_area(test::cylinder(0.7, 3)), 2 * pi * 0.7 * 3, 1e-10);
  // A parallelogram, and the saddle z = x y over the unit square against its own integral in one dimension:
  // int sqrt(1 + x^2 + y^2) dy = [y/2 sqrt(a + y^2) + a/2 asinh(y / sqrt a)], a = 1 + x^2, by a fine midpoint rule.
  Eigen::Matrix3Xd corners(3, 4);
  corners << 0, 2, 1, 3, 0, 0, 1, 1, 0, 0, 0, 0;
  expect_near_rel(surface_area({KnotVector(), KnotVector(), corners}), 2, 1e-14);
  corners << 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 1;
  double expected = 0;
  constexpr int n = 200000;
  for (int k = 0; k < n; ++k) {
    const double a = 1 + std::pow((k + 0.5) / n, 2);
    expected += (std::sqrt(a + 1) / 2 + a / 2 * std::asinh(1 / std::sqrt(a))) / n;
  }
  expect_near_rel(surface_area({KnotVector(), KnotVector(), corners}), expected, 1e-10);
}

TEST(SurfaceArea, DoesNotDependOnTheRepresentation) {
  SCOPED_TRACE("seed 82");
  test::Random random(82);
  const NurbsSurface s = test::random_surface(random, 2, 3, 3, Ends::unclamped, Kind::rational);
  const double area = surface_area(s);
  expect_near_rel(surface_area(elevate_degree(clamp(s), Direction::u, 4)), area, 1e-9);
}

}  // namespace
}  // namespace toile
