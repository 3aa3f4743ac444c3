// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/pull_back.h"

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/cubic_fit.h"
#include "geometry/error.h"
#include "geometry/refine.h"
#include "support/near.h"

namespace toile {
namespace {

// A wavy panel of a metre in millimetres.
NurbsSurface wavy() {
  const KnotVector knots = uniform_knots(3, 6);
  const int n = knots.control_point_count();
  Eigen::Matrix3Xd points(3, n * n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double u = knots.greville(i), v = knots.greville(j);
      points.col(i + n * j) << 700 * u + 20 * std::sin(5 * v), 700 * v, 60 * std::sin(6 * u) * std::cos(4 * v);
    }
  return NurbsSurface(knots, knots, points);
}

// A rational cylinder about z, closed in u over [0, 4].
NurbsSurface cylinder() {
  const Curve2 circle = with_domain(circular_arc({0, 0}, 100, 0, 2 * 3.14159265358979323846), {0, 4});
  const int n = circle.knots().control_point_count();
  Eigen::Matrix3Xd points(3, 2 * n);
  std::vector<double> weights;
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < n; ++i) {
      points.col(i + n * j) << circle.points().col(i), 200.0 * j;
      weights.push_back(circle.weight(i));
    }
  return NurbsSurface(circle.knots(), KnotVector(), points, weights);
}

// S(c(t)) to 1e-12 of its size.
Curve3 image(const NurbsSurface& s, const std::function<PathPoint<2>(double)>& c, std::vector<double> breaks = {0, 1}) {
  std::vector<SmoothPath<3>> path;
  for (std::size_t i = 0; i + 1 < breaks.size(); ++i)
    path.push_back({{breaks[i], breaks[i + 1]}, [&](double t) {
                      const PathPoint<2> p = c(t);
                      const SurfaceJet jet = evaluate(s, p.x.x(), p.x.y());
                      return PathPoint<3>{jet.x, jet.u * p.d.x() + jet.v * p.d.y()};
                    }});
  return fit_cubic<3>(path, {.tolerance = 1e-9}).curve;
}

TEST(PullBack, FollowsACurveToANanoOfThePanel) {
  const NurbsSurface s = wavy();
  const auto c = [](double t) {
    return PathPoint<2>{{0.2 + 0.6 * t, 0.3 + 0.3 * std::sin(3 * t)}, {0.6, 0.9 * std::cos(3 * t)}};
  };
  const PulledCurve pulled = pull_back(s, image(s, c));
  const double size = 1000;
  EXPECT_LE(pulled.error, 1e-9 * size);
  EXPECT_LE(pulled.distance, 1e-9 * size);
  for (int i = 0; i <= 200; ++i) {
    const double t = i / 200.0;
    const Eigen::Vector2d p = pulled.curve(t), q = c(t).x;
    EXPECT_LE((s(p.x(), p.y()) - s(q.x(), q.y())).norm(), 2e-9 * size) << t;
  }
}

TEST(PullBack, KeepsBordersKnotLinesAndTheirEndsBitwise) {
  const NurbsSurface s = wavy();
  for (const double v : {0.0, 1.0 / 6, 1.0}) {
    const Curve3 model = image(s, [&](double t) { return PathPoint<2>{{t * (2 - t), v}, {2 - 2 * t, 0}}; });
    const PulledCurve pulled = pull_back(s, model);
    EXPECT_EQ(pulled.curve.degree(), 1);
    const std::vector<double> lines = s.v().breaks();
    const double line = *std::ranges::min_element(lines, {}, [&](double b) { return std::abs(b - v); });
    EXPECT_EQ(pulled.curve.start(), Eigen::Vector2d(0, line));
    EXPECT_EQ(pulled.curve.end(), Eigen::Vector2d(1, line));
  }
}

TEST(PullBack, RunsOnOverASeam) {
  const NurbsSurface s = cylinder();
  EXPECT_EQ(closed_directions(s, 1e-9), (std::array<bool, 2>{true, false}));
  // From u = 3.5 over the seam at 4 to 0.5, with its first half on one side and its second on the other.
  Eigen::Matrix3Xd points(3, 3);
  const double r = 100, c = std::sqrt(0.5);
  points << r * c, r / c, r * c, -r * c, 0, r * c, 50, 50, 50;
  const Curve3 arc(KnotVector(2, {0, 0, 0, 1, 1, 1}), points, {1, c, 1});
  const PulledCurve pulled = pull_back(s, arc);
  EXPECT_NEAR(pulled.curve.start().x(), 3.5, 1e-9);
  EXPECT_NEAR(pulled.curve.end().x(), 4.5, 1e-9);
  EXPECT_NEAR(pulled.curve(0.3).y(), 0.25, 1e-12);
}

TEST(PullBack, SaysHowFarTheCurveLiesOffTheSurface) {
  const NurbsSurface s = cylinder();
  const Curve3 line(KnotVector(), (Eigen::Matrix3Xd(3, 2) << 0, 0, 100.25, 100.25, 20, 160).finished());
  const PulledCurve pulled = pull_back(s, line);
  EXPECT_NEAR(pulled.distance, 0.25, 1e-9);
  EXPECT_NEAR(pulled.curve.start().x(), 1, 1e-9);
  const Curve3 far(KnotVector(), (Eigen::Matrix3Xd(3, 2) << 0, 0, 500, 500, 20, 160).finished());
  EXPECT_THROW((void)pull_back(s, far), GeometryError);
}

}  // namespace
}  // namespace toile
