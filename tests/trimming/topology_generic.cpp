// SPDX-License-Identifier: GPL-3.0-or-later
// Trims with nothing special about them.
#include "trims.h"

namespace toile::test {
namespace {

TEST(TrimTopology, UntrimmedFaceIsAllInside) {
  TrimmedSurface face = untrimmed(unit_cells(4));
  expect_tally(face, {.crossing_uv = 16, .inside = 16, .vertices = 9});
}

TEST(TrimTopology, RectangleOnKnotLinesCutsNothing) {
  const TrimmedSurface face = trimmed(unit_cells(4), {polygon_loop({{1, 1}, {3, 1}, {3, 2}, {1, 2}})});
  expect_tally(face, {.crossing_uv = 6, .inside = 2, .outside = 14});
}

TEST(TrimTopology, RectangleOffKnotLines) {
  const TrimmedSurface face =
      trimmed(unit_cells(4), {polygon_loop({{0.5, 0.5}, {3.25, 0.5}, {3.25, 2.5}, {0.5, 2.5}})});
  expect_tally(face, {.crossing_u = 6, .crossing_v = 4, .inside = 2, .cut = 10, .outside = 4, .vertices = 6});
}

TEST(TrimTopology, CircleCountsItsCrossings) {
  const TrimmedSurface face = trimmed(unit_cells(4), {loop_of({round_curve({2, 2}, 1.5)})});
  // Lines 1, 2, 3 of each direction, twice; the four cells around the centre are inside, the twelve around cut.
  const TrimTopology t =
      expect_tally(face, {.crossing_u = 6, .crossing_v = 6, .inside = 4, .cut = 12, .outside = 0, .vertices = 9});
  for (const TrimEvent& e : t.events) expect_near_rel((e.uv - Vector2d(2, 2)).norm(), 1.5, 1e-14);
}

TEST(TrimTopology, CubicOutlineWithHoles) {
  const std::vector<Curve2> outline = {bezier_curve({{0.5, 0.5}, {2, 0.25}, {5, 0.75}, {7.5, 0.5}}),
                                       bezier_curve({{7.5, 0.5}, {7.25, 3}, {6.75, 5}, {7.5, 7.5}}),
                                       bezier_curve({{7.5, 7.5}, {5, 7.75}, {3, 6.5}, {0.5, 7.5}}),
                                       bezier_curve({{0.5, 7.5}, {0.25, 5}, {0.75, 2}, {0.5, 0.5}})};
  const TrimmedSurface face =
      trimmed(unit_cells(8), {loop_of(outline), backwards(loop_of({round_curve({2.5, 2.5}, 1)})),
                              backwards(polygon_loop({{5.25, 5.25}, {5.75, 5.25}, {5.75, 5.75}, {5.25, 5.75}}))});
  TrimmedSurface given = face;
  validate_loops(given);
  const TrimTopology topology = trace_trims(given);
  expect_laws(given, topology);
  const Tally t = tally(topology);
  // The hole of radius 1 at a cell's centre meets lines 2 and 3 of both directions twice each; the square none.
  EXPECT_EQ(
      std::count_if(topology.events.begin(), topology.events.end(), [](const TrimEvent& e) { return e.loop == 1; }), 8);
  EXPECT_EQ(
      std::count_if(topology.events.begin(), topology.events.end(), [](const TrimEvent& e) { return e.loop == 2; }), 0);
  EXPECT_EQ(topology.cells[static_cast<std::size_t>(topology.mesh.cell(5, 5))], CellKind::cut);
  EXPECT_EQ(topology.cells[static_cast<std::size_t>(topology.mesh.cell(2, 2))], CellKind::outside);
  EXPECT_EQ(t.vertices, 49 - 4);
}

TEST(TrimTopology, PointsAreInOrOut) {
  const TrimmedSurface face = trimmed(
      unit_cells(4),
      {loop_of({round_curve({2, 2}, 1.5)}), backwards(polygon_loop({{1.5, 1.5}, {2.5, 1.5}, {2.5, 2.5}, {1.5, 2.5}}))});
  const TrimTopology topology = trace_trims(face);
  int in = 0;
  for (int j = 0; j <= 80; ++j)
    for (int i = 0; i <= 80; ++i) {
      const Vector2d x(0.05 * i, 0.05 * j);
      const double r = (x - Vector2d(2, 2)).norm();
      if (std::abs(r - 1.5) < 1e-12) continue;
      const bool hole = std::abs(x.x() - 2) < 0.5 - 1e-9 && std::abs(x.y() - 2) < 0.5 - 1e-9;
      EXPECT_EQ(contains(face, topology, x), r < 1.5 && !hole) << x.transpose();
      in += r < 1.5 && !hole;
    }
  EXPECT_GT(in, 1000);
  for (const Vector2d& x :
       {Vector2d(3.5, 2), Vector2d(2, 0.5), Vector2d(1.5, 1.5), Vector2d(2, 2.5), Vector2d(2.5, 1.75)}) {
    EXPECT_TRUE(contains(face, topology, x)) << x.transpose();
  }
  EXPECT_FALSE(contains(face, topology, {std::nextafter(3.5, 4), 2}));
  EXPECT_FALSE(contains(face, topology, {std::nextafter(1.5, 2), 2}));
}

}  // namespace
}  // namespace toile::test
