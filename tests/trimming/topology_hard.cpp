// SPDX-License-Identifier: GPL-3.0-or-later
// Trims that touch, follow or barely miss knot lines; each also mirrored, turned, scaled, reversed and knot-refined.
#include <numbers>

#include "trims.h"

namespace toile::test {
namespace {

TrimLoop border_loop(double n) {
  return polygon_loop({{0, 0}, {n, 0}, {n, n}, {0, n}});
}

TEST(TrimTopology, CircleTouchingFourLinesTouchesEachOnce) {
  const TrimmedSurface face = trimmed(unit_cells(5), {loop_of({round_curve({2.5, 2.5}, 1.5)})});
  expect_tally(face, {.crossing_u = 4,
                      .crossing_v = 4,
                      .tangent_u = 2,
                      .tangent_v = 2,
                      .inside = 1,
                      .cut = 8,
                      .outside = 16,
                      .vertices = 4});
}

TEST(TrimTopology, CircleTouchingInKnotVertices) {
  const TrimmedSurface face = trimmed(unit_cells(4), {loop_of({round_curve({2, 2}, 1, 0.5)})});
  expect_tally(face, {.crossing_uv = 4, .cut = 4, .outside = 12, .vertices = 1});
}

// A touch is one rounding away from two crossings and from none; each is told from the others.
TEST(TrimTopology, CircleAnUlpPastALineCrossesItTwice) {
  for (const double past : {0x1p-50, 1e-10, 1e-7, 1e-3}) {
    SCOPED_TRACE(past);
    const Tally beyond{.crossing_u = 8, .crossing_v = 8, .inside = 1, .cut = 12, .outside = 12, .vertices = 4};
    const Tally short_of{.crossing_u = 4, .crossing_v = 4, .inside = 1, .cut = 8, .outside = 16, .vertices = 4};
    expect_tally(trimmed(unit_cells(5), {loop_of({round_curve({2.5, 2.5}, 1.5 + past)})}), beyond, past > 1e-12);
    expect_tally(trimmed(unit_cells(5), {loop_of({round_curve({2.5, 2.5}, 1.5 - past)})}), short_of, past > 1e-12);
  }
}

// v - 1 = (3 t - 1)^2: a touch at t = 1/3, where no double is.
TEST(TrimTopology, TouchAtAParameterThatIsNoDouble) {
  const TrimmedSurface face = trimmed(
      unit_cells(6), {loop_of({bezier_curve({{1.5, 2}, {2.5, -1}, {3.5, 5}}), line_segment<2>({3.5, 5}, {1.5, 2})})});
  const TrimTopology t =
      expect_tally(face, {.crossing_u = 4, .crossing_v = 6, .tangent_v = 2, .cut = 9, .outside = 27, .vertices = 3});
  EXPECT_GT(t.counts.algebraic, 0);
}

// v - 1 = (3 t - 1)^3 crosses although it is flat; a quartic touch does not.
TEST(TrimTopology, MultiplicityDecidesCrossingOrTouch) {
  const auto on_line = [](const TrimTopology& t, int line, PointKind kind) {
    return std::count_if(t.events.begin(), t.events.end(),
                         [&](const TrimEvent& e) { return e.curve == 0 && e.line_v == line && e.kind == kind; });
  };
  // v = 2 + (3 t - 1)^3: Bernstein -1, 2, -4, 8 about 2.
  const TrimTopology cubic = trace_trims(trimmed(
      unit_cells(11),
      {loop_of({bezier_curve({{1.25, 1}, {2.25, 4}, {3.25, -2}, {4.25, 10}}), line_segment<2>({4.25, 10}, {0.25, 10}),
                line_segment<2>({0.25, 10}, {0.25, 1}), line_segment<2>({0.25, 1}, {1.25, 1})})}));
  EXPECT_EQ(on_line(cubic, 2, PointKind::crossing_v), 1);
  EXPECT_EQ(on_line(cubic, 2, PointKind::tangent_v), 0);
  // v = 1 + k (3t-1)^4 from (3t-1)^4 = 1 - 12 t + 54 t^2 - 108 t^3 + 81 t^4: Bernstein 1, -2, 4, -8, 16.
  const auto quartic = bezier_curve({{1.25, 1.25}, {2.25, 0.5}, {3.25, 2}, {4.25, -1}, {5.25, 5}});
  const TrimmedSurface face =
      trimmed(unit_cells(6),
              {loop_of({quartic, line_segment<2>({5.25, 5}, {1.25, 5}), line_segment<2>({1.25, 5}, {1.25, 1.25})})});
  const TrimTopology t = trace_trims(face);
  EXPECT_EQ(on_line(t, 1, PointKind::tangent_v), 1);
  EXPECT_EQ(on_line(t, 1, PointKind::crossing_v), 0);
}

// v - 6 = (1 - 1.5 s)^5 / 8 + (1 - s)^5 / 2^38: one crossing near a fivefold root, at ((1.5 s - 1) / (1 - s))^5 =
// 2^-35.
TEST(TrimTopology, FlatCrossingsAreFoundWhereTheyAre) {
  std::vector<Vector2d> control;
  for (int k = 0; k <= 5; ++k) control.emplace_back(3 - k * 0.25, 6 + 0.125 * std::pow(-0.5, k));
  control[0].y() += 0x1p-38;
  const TrimmedSurface face = trimmed(
      unit_cells(8), {loop_of({bezier_curve(control), line_segment<2>(control[5], {1.75, 3.5}),
                               line_segment<2>({1.75, 3.5}, {3, 3.5}), line_segment<2>({3, 3.5}, control[0])})});
  const TrimTopology t = trace_trims(face);
  const double s = (1 + 0x1p-7) / (1.5 + 0x1p-7);
  const auto event =
      std::find_if(t.events.begin(), t.events.end(), [](const TrimEvent& e) { return e.curve == 0 && e.line_v == 6; });
  ASSERT_NE(event, t.events.end());
  EXPECT_EQ(event->kind, PointKind::crossing_v);
  expect_near_rel(event->t, s, 1e-15);
  expect_near_rel(event->uv.x(), 3 - 1.25 * s, 1e-15);
}

TEST(TrimTopology, DiagonalThroughVertices) {
  expect_tally(trimmed(unit_cells(4), {polygon_loop({{0, 0}, {4, 4}, {0, 4}})}),
               {.crossing_uv = 12, .inside = 6, .cut = 4, .outside = 6, .vertices = 3});
  expect_tally(trimmed(unit_cells(4), {polygon_loop({{2, 1}, {3, 2}, {2, 3}, {1, 2}})}),
               {.crossing_uv = 4, .cut = 4, .outside = 12, .vertices = 1});
}

TEST(TrimTopology, LineThroughOneVertexInThree) {
  expect_tally(trimmed(unit_cells(6), {polygon_loop({{0, 1}, {6, 3}, {6, 6}, {0, 6}})}),
               {.crossing_u = 4, .crossing_uv = 16, .inside = 21, .cut = 6, .outside = 9, .vertices = 17});
}

// (u, v) = (1 + 3 t, 1 + (3 t - 1)(t + 1)) passes (2, 1) at t = 1/3.
TEST(TrimTopology, CurveThroughAVertexAtAParameterThatIsNoDouble) {
  expect_tally(
      trimmed(unit_cells(5), {loop_of({bezier_curve({{1, 0}, {2.5, 1}, {4, 5}}), line_segment<2>({4, 5}, {1, 5}),
                                       line_segment<2>({1, 5}, {1, 0})})}),
      {.crossing_u = 1, .crossing_v = 3, .crossing_uv = 10, .inside = 6, .cut = 6, .outside = 13, .vertices = 5});
}

// A parabola that touches v = 1 in the vertex (2, 1).
TEST(TrimTopology, CurveTouchingALineInAVertex) {
  expect_tally(
      trimmed(unit_cells(4),
              {loop_of({bezier_curve({{1, 2.5}, {2, -0.5}, {3, 2.5}}), line_segment<2>({3, 2.5}, {1, 2.5})})}),
      {.crossing_u = 1, .crossing_v = 2, .tangent_u = 2, .crossing_uv = 1, .cut = 4, .outside = 12, .vertices = 1});
}

TEST(TrimTopology, RunAlongALineHasEndsAndVertices) {
  // Back on the side it came from.
  expect_tally(trimmed(unit_cells(4), {polygon_loop({{1, 0.5}, {2.5, 0.5}, {2.5, 2.5}, {1, 2.5}})}), {.crossing_u = 2,
                                                                                                      .crossing_v = 2,
                                                                                                      .tangent_u = 2,
                                                                                                      .crossing_uv = 2,
                                                                                                      .inside = 1,
                                                                                                      .cut = 5,
                                                                                                      .outside = 10,
                                                                                                      .vertices = 2});
  // Across.
  expect_tally(
      trimmed(unit_cells(4), {polygon_loop({{0.5, 0.5}, {3.5, 0.5}, {3.5, 1.5}, {2, 1.5}, {2, 2.5}, {0.5, 2.5}})}),
      {.crossing_u = 7, .crossing_v = 3, .crossing_uv = 1, .inside = 1, .cut = 9, .outside = 6, .vertices = 4});
}

// The same two shapes with the run drawn as two segments joined off the vertices, and as a cubic with uneven speed.
TEST(TrimTopology, RunsDontDependOnHowTheyAreDrawn) {
  const std::vector<Vector2d> p = {{1, 0.5}, {2.5, 0.5}, {2.5, 2.5}, {1, 2.5}};
  const Tally expected{.crossing_u = 2,
                       .crossing_v = 2,
                       .tangent_u = 2,
                       .crossing_uv = 2,
                       .inside = 1,
                       .cut = 5,
                       .outside = 10,
                       .vertices = 2};
  const auto side = [&](int k) {
    return line_segment<2>(p[static_cast<std::size_t>(k)], p[static_cast<std::size_t>(k + 1)]);
  };
  expect_tally(trimmed(unit_cells(4), {loop_of({side(0), side(1), side(2), line_segment<2>({1, 2.5}, {1, 1.25}),
                                                line_segment<2>({1, 1.25}, {1, 0.5})})}),
               expected);
  expect_tally(trimmed(unit_cells(4),
                       {loop_of({side(0), side(1), side(2), bezier_curve({{1, 2.5}, {1, 1.25}, {1, 1}, {1, 0.5}})})}),
               expected);
  expect_tally(
      trimmed(unit_cells(4),
              {loop_of({side(0), side(1), side(2), bezier_curve({{1, 2.5}, {1, 2.25}, {1, 0.5}}, {1, 3, 0.7})})}),
      expected);
}

TEST(TrimTopology, SliversPastALine) {
  for (const double e : {1e-3, 1e-6, 1e-10}) {
    SCOPED_TRACE(e);
    expect_tally(trimmed(unit_cells(4), {polygon_loop({{0.5, 0.5}, {2 + e, 0.5}, {2 + e, 1.5}, {0.5, 1.5}})}),
                 {.crossing_u = 4, .crossing_v = 2, .cut = 6, .outside = 10, .vertices = 2});
    expect_tally(trimmed(unit_cells(4), {polygon_loop({{0.5, 0.5}, {2 - e, 0.5}, {2 - e, 1.5}, {0.5, 1.5}})}),
                 {.crossing_u = 2, .crossing_v = 2, .cut = 4, .outside = 12, .vertices = 1});
    // The material between a line and a trim beside it, all along.
    expect_tally(trimmed(unit_cells(4), {polygon_loop({{2, 0}, {2 + e, 0}, {2 + e, 4}, {2, 4}})}),
                 {.crossing_v = 3, .tangent_v = 2, .crossing_uv = 5, .cut = 4, .outside = 12});
  }
}

TEST(TrimTopology, CornersCutInTwoDirections) {
  for (const double e : {1e-3, 1e-6, 1e-10}) {
    SCOPED_TRACE(e);
    expect_tally(trimmed(unit_cells(4), {polygon_loop({{0.5, 0.5}, {3.5 + e, 0.5}, {0.5, 3.5 + e}})}),
                 {.crossing_u = 6, .crossing_v = 6, .inside = 1, .cut = 12, .outside = 3, .vertices = 6});
    expect_tally(trimmed(unit_cells(4), {polygon_loop({{0.5, 0.5}, {3.5 - e, 0.5}, {0.5, 3.5 - e}})}),
                 {.crossing_u = 6, .crossing_v = 6, .cut = 10, .outside = 6, .vertices = 3});
  }
  expect_tally(
      trimmed(unit_cells(4), {polygon_loop({{0.5, 0.5}, {3.5, 0.5}, {0.5, 3.5}})}),
      {.crossing_u = 3, .crossing_v = 3, .crossing_uv = 3, .inside = 1, .cut = 9, .outside = 6, .vertices = 3});
}

TEST(TrimTopology, HolesInOneCell) {
  std::vector<TrimLoop> loops{border_loop(4)};
  for (const double x : {1.25, 1.5, 1.75}) loops.push_back(backwards(loop_of({round_curve({x, 1.5}, 0.0625)})));
  const TrimmedSurface face = trimmed(unit_cells(4), loops);
  const TrimTopology t = expect_tally(face, {.crossing_uv = 16, .inside = 15, .cut = 1, .vertices = 9});
  ASSERT_EQ(t.cut_cells.size(), 1u);
  EXPECT_EQ(t.cut_cells[0].loops.size(), 4u);
}

TEST(TrimTopology, HoleInscribedInACellLeavesFourCorners) {
  const TrimmedSurface face =
      trimmed(unit_cells(4), {border_loop(4), backwards(loop_of({round_curve({1.5, 1.5}, 0.5)}))});
  const TrimTopology t =
      expect_tally(face, {.tangent_u = 2, .tangent_v = 2, .crossing_uv = 16, .inside = 15, .cut = 1, .vertices = 9});
  ASSERT_EQ(t.cut_cells.size(), 1u);
  EXPECT_EQ(t.cut_cells[0].loops.size(), 4u);
  expect_near_rel(cut_area(face, t.cut_cells[0]), 1 - std::numbers::pi / 4, 1e-13);
}

TEST(TrimTopology, OutlineInscribedInACell) {
  const TrimmedSurface face = trimmed(unit_cells(4), {loop_of({round_curve({1.5, 1.5}, 0.5)})});
  const TrimTopology t = expect_tally(face, {.tangent_u = 2, .tangent_v = 2, .cut = 1, .outside = 15});
  expect_near_rel(cut_area(face, t.cut_cells[0]), std::numbers::pi / 4, 1e-13);
}

TEST(TrimTopology, TouchingHoles) {
  // On a knot line, from both sides.
  expect_tally(trimmed(unit_cells(4), {border_loop(4), backwards(loop_of({round_curve({1.5, 1.5}, 0.5, 0.5)})),
                                       backwards(loop_of({round_curve({2.5, 1.5}, 0.5, 0.5)}))}),
               {.tangent_u = 4, .tangent_v = 4, .crossing_uv = 16, .inside = 14, .cut = 2, .vertices = 9});
  // In a corner of one cell, beside each other.
  expect_tally(trimmed(unit_cells(4), {border_loop(4), backwards(polygon_loop({{1, 1}, {1.75, 1.25}, {1.75, 1.5}})),
                                       backwards(polygon_loop({{1, 1}, {1.5, 1.75}, {1.25, 1.75}}))}),
               {.crossing_uv = 18, .inside = 15, .cut = 1, .vertices = 8});
  // The same off every line.
  expect_tally(
      trimmed(unit_cells(4), {border_loop(4), backwards(polygon_loop({{1.125, 1.125}, {1.75, 1.25}, {1.75, 1.5}})),
                              backwards(polygon_loop({{1.125, 1.125}, {1.5, 1.75}, {1.25, 1.75}}))}),
      {.crossing_uv = 16, .inside = 15, .cut = 1, .vertices = 9});
}

TEST(TrimTopology, HoleTouchingTheOutline) {
  expect_tally(trimmed(unit_cells(4), {border_loop(4), backwards(loop_of({round_curve({0.5, 1.5}, 0.5)}))}),
               {.tangent_u = 2, .tangent_v = 2, .crossing_uv = 16, .inside = 15, .cut = 1, .vertices = 9});
}

// A corner on a line: across it, or touching it.
TEST(TrimTopology, CornersOnALine) {
  expect_tally(trimmed(unit_cells(4), {polygon_loop({{0.5, 0.5}, {2, 0.75}, {3.5, 0.5}, {3, 1.5}, {1.5, 1.75}})}),
               {.crossing_u = 6, .crossing_v = 2, .cut = 8, .outside = 8, .vertices = 3});
  expect_tally(trimmed(unit_cells(4), {polygon_loop({{0.5, 0.5}, {2, 1.5}, {0.5, 2.5}})}),
               {.crossing_u = 2, .crossing_v = 4, .tangent_u = 1, .cut = 6, .outside = 10, .vertices = 2});
}

TEST(TrimTopology, EveryPieceRunsWithTheMaterialOnItsLeft) {
  const TrimmedSurface face = trimmed(
      unit_cells(5), {loop_of({round_curve({2.5, 2.5}, 1.75)}), backwards(loop_of({round_curve({2.5, 2.5}, 1)}))});
  const TrimTopology t = trace_trims(face);
  for (const CutCell& cell : t.cut_cells)
    for (const auto& chain : cell.loops)
      for (const BoundaryPiece& piece : chain) {
        const Curve2* curve =
            piece.loop < 0
                ? nullptr
                : &face.loops[static_cast<std::size_t>(piece.loop)].curves[static_cast<std::size_t>(piece.curve)].curve;
        const double mid = (piece.t0 + piece.t1) / 2, h = (piece.t1 - piece.t0) * 1e-3;
        const Vector2d x = curve ? (*curve)(mid) : Vector2d((piece.from + piece.to) / 2);
        const Vector2d along = curve ? Vector2d((*curve)(mid + h) - x) : Vector2d((piece.to - piece.from) * 1e-3);
        const Vector2d left(-along.y(), along.x());
        EXPECT_TRUE(contains(face, t, x + 0.01 * left)) << x.transpose();
        if (curve) {
          EXPECT_FALSE(contains(face, t, x - 0.01 * left)) << x.transpose();
        }
      }
}

}  // namespace
}  // namespace toile::test
