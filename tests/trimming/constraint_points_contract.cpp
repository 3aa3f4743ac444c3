// SPDX-License-Identifier: GPL-3.0-or-later
// The list that `toile inspect` prints.
#include "trims.h"

namespace toile::test {
namespace {

std::vector<ConstraintPoint> points_of(TrimmedSurface& face) {
  validate_loops(face);
  return constraint_points(face, trace_trims(face));
}

TEST(ConstraintPoints, AFaceWithoutATrimHasAllItsVertices) {
  TrimmedSurface face = untrimmed(unit_cells(8));
  const auto points = points_of(face);
  EXPECT_EQ(points.size(), 81u);
  for (const ConstraintPoint& p : points) EXPECT_EQ(p.kind, PointKind::vertex);
}

TEST(ConstraintPoints, AnExplicitBorderTrimHasCrossings) {
  TrimmedSurface face = trimmed(unit_cells(8), {polygon_loop({{0, 0}, {8, 0}, {8, 8}, {0, 8}})});
  const auto points = points_of(face);
  EXPECT_EQ(points.size(), 81u);
  EXPECT_EQ(
      std::count_if(points.begin(), points.end(), [](const ConstraintPoint& p) { return p.kind == PointKind::vertex; }),
      49);
  EXPECT_EQ(std::count_if(points.begin(), points.end(),
                          [](const ConstraintPoint& p) { return p.kind == PointKind::crossing_uv && p.loop == 0; }),
            32);
  // Corner k is where curve k starts.
  EXPECT_EQ(points[49].curve, 0);
  EXPECT_EQ(points[49].t, face.loops[0].curves[0].curve.domain().min);
}

TEST(ConstraintPoints, NoneTwice) {
  TrimmedSurface face = trimmed(unit_cells(4), {polygon_loop({{0, 0}, {4, 0}, {4, 4}, {0, 4}}),
                                                backwards(loop_of({round_curve({1.5, 1.5}, 0.5, 0.5)})),
                                                backwards(loop_of({round_curve({2.5, 1.5}, 0.5, 0.5)}))});
  const auto points = points_of(face);
  std::set<std::pair<double, double>> seen;
  for (const ConstraintPoint& p : points) EXPECT_TRUE(seen.insert({p.u, p.v}).second) << p.u << ", " << p.v;
  EXPECT_EQ(points.size(), 9u + 16u + 7u);
}

// Loop, curve and t name the same place on the file's curves whichever way the loop is given.
TEST(ConstraintPoints, NumbersSurviveReversal) {
  const std::vector<std::vector<TrimLoop>> outlines = {
      {polygon_loop({{0.5, 0.5}, {3, 0.5}, {3, 3.5}, {1.5, 3}})},
      {loop_of({round_curve({2, 2}, 1.5)})},
      {loop_of({bezier_curve({{1, 2}, {2, 0.5}, {3, 2}}), bezier_curve({{3, 2}, {2, 3.5}, {1, 2}})})}};
  for (const auto& outline : outlines) {
    TrimmedSurface forwards = trimmed(unit_cells(4), outline);
    const auto expected = points_of(forwards);
    // The file runs the loop clockwise: same curves, each backwards, numbered in that order.
    TrimmedSurface given = trimmed(unit_cells(4), outline);
    TrimLoop& loop = given.loops[0];
    std::reverse(loop.curves.begin(), loop.curves.end());
    const int n = static_cast<int>(loop.curves.size());
    for (int k = 0; k < n; ++k) {
      loop.curves[static_cast<std::size_t>(k)].reversed = true;
      loop.curves[static_cast<std::size_t>(k)].index = k;
    }
    const auto points = points_of(given);
    EXPECT_TRUE(loop.curves.size() == 1 || loop.curves.front().index > loop.curves.back().index);
    ASSERT_EQ(points.size(), expected.size());
    for (const ConstraintPoint& p : points) {
      const auto same = std::find_if(expected.begin(), expected.end(),
                                     [&](const ConstraintPoint& q) { return q.u == p.u && q.v == p.v; });
      ASSERT_NE(same, expected.end());
      EXPECT_EQ(p.kind, same->kind);
      if (p.loop < 0) continue;
      const Curve2& curve = std::find_if(loop.curves.begin(), loop.curves.end(), [&](const TrimCurve& c) {
                              return c.index == p.curve;
                            })->curve;
      EXPECT_LE((curve(p.t) - Vector2d(p.u, p.v)).norm(), 1e-14);
      // A joint is listed on the later curve in the file's order, or at a single curve's start.
      if (p.t == curve.domain().min || p.t == curve.domain().max) {
        const Vector2d start = n == 1 ? curve.start() : curve.end();  // the file traverses several curves backwards
        EXPECT_EQ(start, Vector2d(p.u, p.v));
      }
    }
  }
}

TEST(ConstraintPoints, OrderIsVerticesThenTheLoop) {
  TrimmedSurface face = trimmed(unit_cells(4), {loop_of({round_curve({2, 2}, 1.5)})});
  const auto points = points_of(face);
  ASSERT_EQ(points.size(), 9u + 12u);
  for (std::size_t k = 1; k < 9; ++k) EXPECT_LT(points[k - 1].v * 10 + points[k - 1].u, points[k].v * 10 + points[k].u);
  for (std::size_t k = 10; k < points.size(); ++k) EXPECT_LT(points[k - 1].t, points[k].t);
  // A smooth joint off every knot line is none.
  for (const ConstraintPoint& p : points) EXPECT_TRUE(p.u == std::floor(p.u) || p.v == std::floor(p.v));
}

TEST(ConstraintPoints, CornersStandWhereATrimTurnsByMoreThanThirtyDegrees) {
  const Vector2d a(3.5, 2.5), b(2.5, 3.5);
  TrimmedSurface face = trimmed(unit_cells(4), {polygon_loop({{0.5, 0.5}, {3.5, 0.5}, a, b, {0.5, 3.5}}),
                                                backwards(loop_of({round_curve({1.5, 1.5}, 0.25, 0.25)}))});
  std::vector<Vector2d> corners;
  for (const ConstraintPoint& p : points_of(face)) {
    if (p.kind != PointKind::corner) continue;
    corners.emplace_back(p.u, p.v);
    EXPECT_EQ(p.loop, 0);
    EXPECT_EQ(p.curve, static_cast<int>(corners.size()) - 1);
    EXPECT_EQ(p.t, 0);
  }
  EXPECT_EQ(corners, (std::vector<Vector2d>{{0.5, 0.5}, {3.5, 0.5}, a, b, {0.5, 3.5}}));
  // On the surface, not in its parameters: drawn out eight times, both ends of the cut turn by 83 and 7 degrees.
  const Eigen::Vector3d drawn_out(8, 1, 1);
  face.surface = face.surface.with_points(drawn_out.asDiagonal() * face.surface.points());
  corners.clear();
  for (const ConstraintPoint& p : constraint_points(face, trace_trims(face)))
    if (p.kind == PointKind::corner) corners.emplace_back(p.u, p.v);
  EXPECT_EQ(corners, (std::vector<Vector2d>{{0.5, 0.5}, {3.5, 0.5}, a, {0.5, 3.5}}));
  // One on a knot line is a crossing already.
  TrimmedSurface on_line = trimmed(unit_cells(4), {polygon_loop({{1, 0.5}, {3, 0.5}, {3, 3.5}, {1, 3.5}})});
  for (const ConstraintPoint& p : points_of(on_line)) EXPECT_NE(p.kind, PointKind::corner);
}

}  // namespace
}  // namespace toile::test
