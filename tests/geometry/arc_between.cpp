// SPDX-License-Identifier: GPL-3.0-or-later
// Arcs between two given points.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "geometry/expect_error.h"
#include "geometry/nurbs_curve.h"

namespace toile {
namespace {

using Eigen::Vector2d;

TEST(ArcBetween, LiesOnItsCircleAndKeepsItsEnds) {
  const Vector2d a(-3, 1.5), b(4.25, 2);
  const double chord = (b - a).norm();
  for (const double turn : {1e-7, 1e-3, 0.5, std::numbers::pi / 2, 2.0, std::numbers::pi, 4.0, 6.2}) {
    for (const double sign : {1.0, -1.0}) {
      const Curve2 arc = circular_arc_between(a, b, sign * turn);
      EXPECT_EQ(arc.start(), a);
      EXPECT_EQ(arc.end(), b);
      const double radius = chord / (2 * std::sin(turn / 2)), apothem = chord / (2 * std::tan(turn / 2));
      const Vector2d left(-(b - a).y() / chord, (b - a).x() / chord);
      const Vector2d centre = (a + b) / 2 + sign * apothem * left;  // left of a turn to the left
      for (int k = 0; k <= 64; ++k) {
        EXPECT_NEAR((arc(k / 64.0) - centre).norm() / radius, 1, 1e-15 * (1 + 4 * std::hypot(3, 4) / radius)) << turn;
      }
    }
  }
}

TEST(ArcBetween, FlatArcsKeepTheirSagitta) {
  // Far centres must not swallow the height of the arc: sagitta = chord / 2 tan(turn / 4).
  for (const double turn : {1e-9, 1e-6, 1e-3}) {
    const Curve2 arc = circular_arc_between({0, 0}, {1, 0}, turn);
    EXPECT_NEAR(-arc(0.5).y() / (0.5 * std::tan(turn / 4)), 1, 1e-14) << turn;
  }
}

TEST(ArcBetween, RunsTheWayItTurns) {
  const Curve2 left = circular_arc_between({0, 0}, {2, 0}, std::numbers::pi);
  EXPECT_NEAR(left(0.5).y(), -1, 1e-15);  // counter-clockwise from (0, 0) to (2, 0): below
  EXPECT_NEAR(circular_arc_between({0, 0}, {2, 0}, -std::numbers::pi)(0.5).y(), 1, 1e-15);
}

TEST(ArcBetween, RefusesWhatIsNoArc) {
  for (const double turn : {0.0, 2 * std::numbers::pi, 7.0, std::nan("")})
    test::expect_geometry_error([&] { circular_arc_between({0, 0}, {1, 0}, turn); }, "an arc that turns by");
  test::expect_geometry_error([] { circular_arc_between({1, 2}, {1, 2}, 1); }, "ends must differ");
}

}  // namespace
}  // namespace toile
