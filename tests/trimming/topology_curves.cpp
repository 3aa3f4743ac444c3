// SPDX-License-Identifier: GPL-3.0-or-later
// Random closed curves: the laws hold, and every answer agrees with dense sampling of the curve.
#include <random>

#include "trims.h"

namespace toile::test {
namespace {

// A closed star-shaped B-spline or NURBS around the middle of [0, n]^2, its joint at a corner.
Curve2 random_blob(std::mt19937& random, double n, int degree, int spans, bool rational) {
  std::uniform_real_distribution<double> unit(0, 1);
  const KnotVector knots = uniform_knots(degree, spans);
  const int count = knots.control_point_count();
  Curve2::Points points(2, count);
  std::vector<double> weights;
  for (int k = 0; k < count; ++k) {
    const double a = 2 * M_PI * k / (count - 1), r = n * (0.2 + 0.25 * unit(random));
    points.col(k) << n / 2 + r * std::cos(a), n / 2 + r * std::sin(a);
    if (rational) weights.push_back(0.5 + 2 * unit(random));
  }
  points.col(count - 1) = points.col(0);
  return Curve2(knots, points, weights);
}

TEST(TrimTopology, RandomCurvesKeepTheLaws) {
  constexpr unsigned seed = 7;
  std::mt19937 random(seed);
  for (int k = 0; k < 200 && !::testing::Test::HasFailure(); ++k) {
    SCOPED_TRACE("seed " + std::to_string(seed) + ", case " + std::to_string(k));
    const int n = 3 + static_cast<int>(random() % 30), degree = 2 + static_cast<int>(random() % 4);
    const Curve2 blob = random_blob(random, n, degree, 5 + static_cast<int>(random() % 30), k % 3 == 0);
    TrimmedSurface face = trimmed(unit_cells(n), {loop_of({blob})});
    validate_loops(face);
    const TrimTopology topology = trace_trims(face);
    expect_laws(face, topology);
    // Crossings of lines by sampling: every change of cell between samples is accounted for by the events between them.
    std::map<int, int> by_sampling, traced;
    constexpr int samples = 20000;
    Vector2d last = blob(0);
    for (int s = 1; s <= samples; ++s) {
      const Vector2d x = blob(s == samples ? 0 : s / static_cast<double>(samples));
      for (int axis = 0; axis < 2; ++axis)
        for (int line = 0; line <= n; ++line) by_sampling[2 * line + axis] += (last[axis] < line) != (x[axis] < line);
      last = x;
    }
    for (const TrimEvent& e : topology.events) {
      if (e.kind == PointKind::crossing_u || e.kind == PointKind::crossing_uv) ++traced[2 * e.line_u];
      if (e.kind == PointKind::crossing_v || e.kind == PointKind::crossing_uv) ++traced[2 * e.line_v + 1];
    }
    for (const auto& [line, count] : by_sampling) {
      // Sampling can only miss pairs that lie closer than its step.
      EXPECT_GE(traced[line], count) << "line " << line;
      EXPECT_EQ((traced[line] - count) % 2, 0) << "line " << line << ": " << traced[line] << ", sampled " << count;
    }
  }
}

// Joints are compared bitwise: a span at a clamped end starts in the control point, however small its coordinate beside
// the others.
TEST(TrimTopology, SpansEndInTheEndsOfClampedCurves) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int k = 0; k < 200; ++k) {
    Curve2::Points points(2, 5);
    std::vector<double> weights;
    for (int i = 0; i < 5; ++i) {
      points.col(i) << unit(random), unit(random) * (i % 4 == 0 ? 0x1p-60 : 1);
      weights.push_back(k % 2 == 0 ? 0.25 + unit(random) : 1);
    }
    const Curve2 curve(KnotVector(3, {0, 0, 0, 0, 0.5, 1, 1, 1, 1}), points, weights);
    const std::vector<TrimSpan> spans = trim_spans(curve);
    ASSERT_EQ(spans.size(), 2u);
    EXPECT_EQ(spans.front().first(), points.col(0));
    EXPECT_EQ(spans.back().last(), points.col(4));
  }
}

// A B-spline whose control points share v = 2 runs on that line exactly, whatever its knots.
TEST(TrimTopology, SplineOnALineStaysOnIt) {
  const KnotVector knots(3, {0, 0, 0, 0, 0.1, 0.37, 0.7, 1, 1, 1, 1});
  Curve2::Points points(2, 7);
  points << 3.5, 3.1, 2.7, 1.9, 1.3, 0.9, 0.5, 2, 2, 2, 2, 2, 2, 2;
  for (const bool rational : {false, true}) {
    const Curve2 top(knots, points,
                     rational ? std::vector<double>{1, 0.3, 2.7, 1.1, 0.9, 5, 1} : std::vector<double>{});
    const TrimmedSurface face =
        trimmed(unit_cells(4), {loop_of({line_segment<2>({0.5, 2}, {0.5, 0.5}), line_segment<2>({0.5, 0.5}, {3.5, 0.5}),
                                         line_segment<2>({3.5, 0.5}, {3.5, 2}), top})});
    expect_tally(face,
                 {.crossing_u = 3,
                  .crossing_v = 2,
                  .tangent_v = 2,
                  .crossing_uv = 3,
                  .inside = 2,
                  .cut = 6,
                  .outside = 8,
                  .vertices = 3},
                 !rational);
  }
}

}  // namespace
}  // namespace toile::test
