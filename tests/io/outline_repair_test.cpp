// SPDX-License-Identifier: GPL-3.0-or-later
// Outlines as drawings hold them: what is drawn out and back goes as a slit, accidents are cut off, faults are named.
#include "io/outline_repair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/refine.h"
#include "io/flat_panel.h"
#include "support/near.h"

namespace toile {
namespace {

using Eigen::Vector2d;
using Points = std::vector<Vector2d>;

// One line a side.
std::vector<TrimCurve> polygon(const Points& corners) {
  std::vector<TrimCurve> out;
  for (std::size_t k = 0; k < corners.size(); ++k)
    out.push_back({polyline_curve({corners[k], corners[(k + 1) % corners.size()]}), static_cast<int>(k), false, {}});
  return out;
}
// One polyline around.
std::vector<TrimCurve> ring(Points corners) {
  corners.push_back(corners.front());
  return {{polyline_curve(corners), 0, false, {}}};
}
double area(const RepairedOutline& outline) {
  double sum = 0;
  for (const auto& loop : outline.loops) sum += polygon_area(loop);
  return sum;
}

TEST(OutlineRepair, ASoundOutlineComesBackBitForBit) {
  const Points star{{0, 0}, {10, 0}, {10, 10}, {5, 2}, {0, 10}};
  for (const auto& chain : {polygon(star), ring(star)}) {
    const RepairedOutline out = repair_outline(chain, {0.01, 0.1});
    EXPECT_TRUE(out.changes.empty());
    ASSERT_EQ(out.loops.size(), 1u);
    ASSERT_EQ(out.loops[0].size(), chain.size());
    for (std::size_t k = 0; k < chain.size(); ++k) EXPECT_EQ(out.loops[0][k].curve, chain[k].curve);
    EXPECT_EQ(self_crossing(out.loops[0]), "");
  }
}

TEST(OutlineRepair, AnEdgeDrawnOutAndBackIsASlit) {
  // From (300, 200) 10 inwards and back; then a longer way in two legs, whose way back is one stroke.
  for (const Points& tip : {Points{{290, 200}, {300, 200}}, Points{{295, 200}, {290, 200}, {300, 200}}}) {
    Points corners{{0, 0}, {300, 0}, {300, 200}};
    corners.insert(corners.end(), tip.begin(), tip.end());
    corners.insert(corners.end(), {{300, 400}, {0, 400}});
    for (const auto& chain : {polygon(corners), ring(corners)}) {
      const RepairedOutline out = repair_outline(chain, {0.01, 0});
      ASSERT_EQ(out.loops.size(), 1u);
      expect_near_rel(area(out), 300 * 400, 1e-14);
      ASSERT_EQ(out.slits.size(), 1u);
      EXPECT_EQ(out.slits[0].start(), Vector2d(300, 200));
      EXPECT_EQ(out.slits[0].end(), Vector2d(290, 200));
      ASSERT_EQ(out.changes.size(), 1u);
      expect_near_rel(out.changes[0].size, 10, 1e-14);
      EXPECT_EQ(self_crossing(out.loops[0]), "");
      for (std::size_t k = 0; k < out.loops[0].size(); ++k)
        EXPECT_EQ(out.loops[0][k].curve.end(), out.loops[0][(k + 1) % out.loops[0].size()].curve.start());
    }
  }
}

TEST(OutlineRepair, AStrokeThatOvershootsAndComesBackIsOne) {
  // The way back goes on past where the way out began: only the shared stretch goes.
  const RepairedOutline out = repair_outline(polygon({{0, 0}, {100, 0}, {100, 50}, {120, 50}, {0, 50}}), {0.001, 0});
  expect_near_rel(area(out), 100 * 50, 1e-14);
  ASSERT_EQ(out.slits.size(), 1u);
}

TEST(OutlineRepair, ACurveDrawnOutAndBackIsASlitToo) {
  const Curve2 arc = circular_arc_between({100, 50}, {60, 50}, 1);
  std::vector<TrimCurve> chain = polygon({{0, 0}, {100, 0}, {100, 50}, {100, 100}, {0, 100}});
  chain.insert(chain.begin() + 2, {arc, 7, false, {}});
  chain.insert(chain.begin() + 3, {reversed(arc), 8, false, {}});
  const RepairedOutline out = repair_outline(chain, {0.001, 0});
  ASSERT_EQ(out.loops.size(), 1u);
  EXPECT_EQ(out.loops[0].size(), 5u);
  ASSERT_EQ(out.slits.size(), 1u);
  EXPECT_EQ(out.slits[0], arc);
}

TEST(OutlineRepair, ACutToAHoleLeavesBothLoops) {
  // In one stroke: around, in to the hole, around it, back out.
  const Points corners{{0, 0},   {100, 0}, {100, 50}, {60, 50},  {60, 70},   {40, 70},
                       {40, 30}, {60, 30}, {60, 50},  {100, 50}, {100, 100}, {0, 100}};
  const RepairedOutline out = repair_outline(polygon(corners), {0.001, 0});
  ASSERT_EQ(out.loops.size(), 2u);
  ASSERT_EQ(out.slits.size(), 1u);
  std::vector<double> areas{std::abs(polygon_area(out.loops[0])), std::abs(polygon_area(out.loops[1]))};
  std::ranges::sort(areas);
  expect_near_rel(areas[0], 20 * 40, 1e-14);
  expect_near_rel(areas[1], 100 * 100, 1e-14);
}

TEST(OutlineRepair, DartsStay) {
  // Legs of 100 that end 0.5 apart, tip sharp: narrow, and no slit.
  const Points dart{{0, 0}, {100, 0}, {100, 200}, {50.25, 200}, {50, 100}, {49.75, 200}, {0, 200}};
  EXPECT_TRUE(repair_outline(polygon(dart), {0.01, 0.1}).changes.empty());
}

TEST(OutlineRepair, ALittleLoopIsCutOff) {
  // Edges that overshoot their corner by 0.05, drawn on.
  const Points corners{{0, 0}, {100, 0}, {100, 100.05}, {99.95, 100.05}, {100.02, 100}, {0, 100}};
  const RepairedOutline out = repair_outline(polygon(corners), {0.001, 0.1});
  ASSERT_FALSE(out.changes.empty());
  EXPECT_NE(out.changes[0].what.find("is cut off"), std::string::npos);
  EXPECT_LE(out.changes[0].size, 0.1);
  EXPECT_EQ(self_crossing(out.loops.at(0)), "");
  EXPECT_NEAR(area(out), 100 * 100, 0.01);
  // Below the size of the loop nothing is done, and the fault is named with its size.
  const RepairedOutline kept = repair_outline(polygon(corners), {0.001, 0.01});
  EXPECT_TRUE(kept.changes.empty());
  EXPECT_NE(self_crossing(kept.loops.at(0)).find("crosses itself at ("), std::string::npos);
}

TEST(OutlineRepair, ABowTieIsNoAccidentHoweverCoarseTheNumbers) {
  const Points bow{{0, 0}, {8, 0}, {0, 6}, {8, 6}};
  for (const auto& chain : {polygon(bow), ring(bow)}) {
    const RepairedOutline out = repair_outline(chain, {1, 10});
    EXPECT_TRUE(out.changes.empty());
    EXPECT_EQ(self_crossing(out.loops.at(0)),
              "the outline crosses itself at (4, 3); the smaller loop there measures 8 x 3");
  }
}

TEST(OutlineRepair, TheStepOfNumbersIsTheirLastDecimal) {
  EXPECT_EQ(decimal_step({{1, 20}, {300, -4}}), 1);
  EXPECT_EQ(decimal_step({{1.5, 20}, {300.25, -4}}), 0.01);
  EXPECT_EQ(decimal_step({{0.1, 0.2}, {0.3, 1e4 + 0.7}}), 0.1);
  EXPECT_EQ(decimal_step({{std::numbers::pi, 0}}), 0);
}

}  // namespace
}  // namespace toile
