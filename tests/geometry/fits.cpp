// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "geometry/cubic_fit.h"
#include "geometry/error.h"
#include "geometry/refine.h"
#include "geometry/surface_fit.h"

namespace toile {
namespace {

TEST(CubicFit, StaysWithinItsToleranceAndSaysHowFar) {
  const SmoothPath<2> circle{{0, 3}, [](double t) {
                               return PathPoint<2>{{std::cos(t), std::sin(t)}, {-std::sin(t), std::cos(t)}};
                             }};
  for (const double tolerance : {1e-3, 1e-6, 1e-9}) {
    const CubicFit<2> fit = fit_cubic<2>({&circle, 1}, {.tolerance = tolerance});
    EXPECT_LE(fit.error, 1.5 * tolerance);
    double largest = 0;
    for (int i = 0; i <= 1000; ++i) {
      const double t = 0.003 * i;
      largest = std::max(largest, (fit.curve(t) - Eigen::Vector2d(std::cos(t), std::sin(t))).norm());
    }
    EXPECT_LE(largest, 1.1 * fit.error + 1e-15);
    EXPECT_EQ(fit.curve.domain().max, 3);
  }
}

TEST(CubicFit, KeepsAKink) {
  const std::vector<SmoothPath<2>> path{{{0, 1},
                                         [](double t) {
                                           return PathPoint<2>{{t, 0}, {1, 0}};
                                         }},
                                        {{1, 2}, [](double t) {
                                           return PathPoint<2>{{1, t - 1}, {0, 1}};
                                         }}};
  const CubicFit<2> fit = fit_cubic<2>(path, {.tolerance = 1e-12});
  EXPECT_EQ(fit.curve(1), Eigen::Vector2d(1, 0));
  EXPECT_LE(fit.error, 1e-15);
  EXPECT_EQ(fit.curve.knots().multiplicity(1), 3);
}

TEST(SurfaceFit, ErrorFallsWithTheFourthPowerUntilTheToleranceIsMet) {
  const auto f = [](double u, double v) -> Eigen::Vector3d { return {u, v, std::sin(3 * u) * std::cos(2 * v)}; };
  const std::vector<FitBreak> unit{{0, 0}, {1, 0}};
  const SurfaceFit coarse = fit_surface(f, unit, unit, 0, 8), fine = fit_surface(f, unit, unit, 0, 16);
  EXPECT_LE(fine.error, coarse.error / 10);
  const SurfaceFit fit = fit_surface(f, unit, unit, 1e-7);
  EXPECT_LE(fit.error, 1e-7);
  EXPECT_LE((fit.surface(0.371, 0.843) - f(0.371, 0.843)).norm(), 1.5e-7);
}

TEST(SurfaceFit, FollowsAFoldWhereItIsToldOfIt) {
  const auto f = [](double u, double v) -> Eigen::Vector3d { return {u, v, std::abs(u - 0.25)}; };
  const SurfaceFit fit = fit_surface(f, {{0, 0}, {0.25, 0}, {1, 0}}, {{0, 0}, {1, 0}}, 1e-9);
  EXPECT_LE(fit.error, 1e-14);
}

TEST(Refine, AnotherDomainIsTheSameCurve) {
  const Curve2 arc = circular_arc({1, 2}, 3, 0.1, 4);
  const Curve2 moved = with_domain(arc, {-7, 0.3});
  EXPECT_EQ(moved.domain().min, -7);
  EXPECT_EQ(moved.domain().max, 0.3);
  for (const double f : {0.0, 0.2, 0.55, 1.0}) EXPECT_LE((moved(-7 + 7.3 * f) - arc(f)).norm(), 1e-14);
}

}  // namespace
}  // namespace toile
