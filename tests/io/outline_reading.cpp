// SPDX-License-Identifier: GPL-3.0-or-later
// Files without faces: closed plane outlines are panels, what lies inside them belongs to them.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "io/iges_corpus.h"
#include "io/outlines.h"
#include "io/panel_facts.h"
#include "support/near.h"
#include "trimming/loops.h"

namespace toile {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::area;
using test::count;

TEST(Outlines, ClosedChainsArePanelsInnerOnesHoles) {
  const PanelFile file = test::read_corpus("outlines_only");
  ASSERT_EQ(file.panels.size(), 3u);
  const TrimmedSurface &front = file.panels[0], &back = file.panels[1], &island = file.panels[2];
  EXPECT_EQ(front.name, "FRONT");
  EXPECT_EQ(island.name, "DOT");
  ASSERT_EQ(front.loops.size(), 2u);
  ASSERT_EQ(back.loops.size(), 2u);
  EXPECT_EQ(island.loops.size(), 1u);
  // 400 x 300 and a half disc of radius 200, less a disc of radius 30.
  expect_near_rel(area(front), 120000 + 20000 * std::numbers::pi - 900 * std::numbers::pi, 1e-12);
  expect_near_rel(area(back), 300 * 200 + 300 * 60 / 2 - 50 * 30, 1e-12);
  expect_near_rel(area(island), 100 * std::numbers::pi, 1e-12);
}

TEST(Outlines, ParameterCurvesAreTheCurvesOwnNumbers) {
  const PanelFile file = test::read_corpus("outlines_only");
  const TrimmedSurface& front = file.panels[0];
  ASSERT_EQ(front.loops[0].curves.size(), 4u);
  const Curve2& side = front.loops[0].curves[1].curve;
  EXPECT_EQ(side.start(), Vector2d(400, 0));
  EXPECT_EQ(side.end(), Vector2d(400, 300));
  const Curve2& arc = front.loops[0].curves[2].curve;
  EXPECT_TRUE(arc.rational());
  for (int k = 0; k <= 20; ++k) EXPECT_NEAR((arc(k / 20.0) - Vector2d(200, 300)).norm(), 200, 200 * 1e-15);
  // The surface is the plane itself and holds the outline.
  EXPECT_EQ(front.surface(100, 250), Vector3d(100, 250, 5));
  EXPECT_LE(front.surface.v().domain().min, 0);
  EXPECT_GE(front.surface.v().domain().max, 500);
  // A loose chain runs as its first curve does.
  const TrimLoop& loose = file.panels[1].loops[0];
  ASSERT_EQ(loose.curves.size(), 4u);
  EXPECT_EQ(loose.curves[0].curve.start(), Vector2d(600, 0));
  EXPECT_EQ(loose.curves[2].curve.points().cols(), 3);
  EXPECT_EQ(loose.curves[2].curve.start(), Vector2d(900, 200));  // the polyline was drawn the other way
  EXPECT_EQ(loose.gap, 0);
}

TEST(Outlines, MarksStayWithTheirPanel) {
  const PanelFile file = test::read_corpus("outlines_only");
  const TrimmedSurface& front = file.panels[0];
  EXPECT_EQ(count(front, MarkKind::grain), 1);
  EXPECT_EQ(count(front, MarkKind::line), 1);
  EXPECT_EQ(count(front, MarkKind::notch), 2);
  EXPECT_EQ(count(front, MarkKind::drill), 1);
  ASSERT_EQ(count(front, MarkKind::text), 1);
  EXPECT_EQ(std::ranges::find(front.marks, MarkKind::text, &PanelMark::kind)->text, "Front");
  EXPECT_EQ(count(file.panels[1], MarkKind::grain), 1);
  EXPECT_TRUE(test::has_warning(file, "the open curve lies in no panel"));
  EXPECT_TRUE(test::has_warning(file, "is taken as its grain line"));
}

TEST(Outlines, TheGrainLineIsTheWarp) {
  const PanelFile file = test::read_corpus("outlines_only");
  // Front: the warp runs along (50, 200), the weft at right angles, along (200, -50). Back: warp along x.
  expect_near_rel(grain_angle(file.panels[0]).value(), -std::atan2(50, 200), 1e-14);
  expect_near_rel(grain_angle(file.panels[1]).value(), std::numbers::pi / 2, 1e-14);
  EXPECT_FALSE(grain_angle(file.panels[2]).has_value());
}

TEST(Outlines, LieInAnyPlane) {
  const PanelFile file = test::read_corpus("outlines_in_planes");
  ASSERT_EQ(file.panels.size(), 2u);
  const TrimmedSurface& yz = file.panels[0];
  EXPECT_EQ(yz.name, "YZ");
  EXPECT_EQ(yz.metres_per_unit, 0.0254);
  EXPECT_EQ(yz.loops[0].curves[0].curve.end(), Vector2d(3, 0));
  EXPECT_EQ(yz.surface(1, 2), Vector3d(20, 1, 2));
  // A quarter of a parabola-cornered 3 x 4 rectangle: what the corner loses is 1/6 of it.
  expect_near_rel(area(yz), 12 - 12 / 6.0, 1e-13);
  const TrimmedSurface& tilted = file.panels[1];
  expect_near_rel(area(tilted), 25, 1e-12);
  for (const TrimCurve& trim : tilted.loops[0].curves)
    for (int k = 0; k <= 4; ++k) {
      const Vector2d p = trim.curve(trim.curve.domain().min + trim.curve.domain().length() * k / 4.0);
      const Vector3d corner[] = {{0, 0, 0}, {3, 0, 4}, {3, 5, 4}, {0, 5, 0}, {0, 0, 0}};
      EXPECT_NEAR((tilted.surface(p.x(), p.y()) - corner[k]).norm(), 0, 2e-15 * 8);
    }
  EXPECT_TRUE(test::has_warning(file, "leaves its plane"));
}

TEST(Outlines, RoundTripsAreExact) {
  for (const char* name : {"outlines_only", "outlines_in_planes"}) {
    const PanelFile file = test::read_corpus(name);
    EXPECT_TRUE(roundtrip(file, IgesMode::replay).exact());
    EXPECT_TRUE(roundtrip(file, IgesMode::rewrite).exact());
    // As faces in a new file: the same nets and parameter curves.
    std::vector<OutputFace> faces;
    for (const TrimmedSurface& panel : file.panels) faces.push_back({panel, panel.name, 0, std::nullopt});
    IgesHeader header;
    header.unit = file.unit;
    const PanelFile again = parse_iges(format_iges(faces, header).text, name);
    ASSERT_EQ(again.panels.size(), file.panels.size());
    for (std::size_t k = 0; k < again.panels.size(); ++k) {
      EXPECT_EQ(again.panels[k].surface, file.panels[k].surface);
      expect_near_rel(area(again.panels[k]), area(file.panels[k]), 1e-14);
    }
  }
}

LooseCurve polygon(int id, const std::vector<Vector2d>& corners) {
  LooseCurve loose{id, {}, {}};
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vector2d a = corners[k], b = corners[(k + 1) % corners.size()];
    loose.pieces.push_back(line_segment<3>({a.x(), a.y(), 0}, {b.x(), b.y(), 0}));
  }
  return loose;
}
LooseCurve square(int id, double x, double y, double side) {
  return polygon(id, {{x, y}, {x + side, y}, {x + side, y + side}, {x, y + side}});
}

TEST(Outlines, EveryOtherNestingIsAPanel) {
  const Outlines found = find_outlines(
      {square(1, 4, 4, 2), square(2, 0, 0, 10), square(3, 1, 1, 8), square(4, 2, 2, 6), square(5, 20, 0, 3)}, {}, 0);
  ASSERT_EQ(found.panels.size(), 3u);
  EXPECT_EQ(found.ids, (std::vector<int>{2, 4, 5}));
  expect_near_rel(area(found.panels[0]), 100 - 64, 1e-14);
  expect_near_rel(area(found.panels[1]), 36 - 4, 1e-14);
  expect_near_rel(area(found.panels[2]), 9, 1e-14);
}

TEST(Outlines, AClosedCurveAcrossAnOutlineIsAMark) {
  const Outlines found = find_outlines({square(1, 0, 0, 100), square(2, 99, 50, 2)}, {}, 0);
  ASSERT_EQ(found.panels.size(), 1u);
  EXPECT_EQ(found.panels[0].loops.size(), 1u);
  EXPECT_EQ(found.panels[0].marks.size(), 3u) << "one side lies outside";
  EXPECT_FALSE(grain_angle(found.panels[0]).has_value()) << "a side of a square is no grain line";
  ASSERT_EQ(found.notes.size(), 2u);
  EXPECT_NE(found.notes[0].what.find("crosses the outline of entity 1"), std::string::npos);
}

// Exporters draw a boundary on two layers, or twice on one.
TEST(Outlines, AnOutlineDrawnAgainIsOnePanel) {
  // Middles of these edges are rounded: they lie on neither side of the line for sure.
  const std::vector<Vector2d> corners{{0.1, 0.2}, {97.3, 3.7}, {133.1, 61.9}, {41.7, 88.3}, {-7.9, 40.3}};
  double twice = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vector2d a = corners[k], b = corners[(k + 1) % corners.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  for (const bool back : {false, true}) {
    for (std::size_t shift = 0; shift < corners.size(); ++shift) {
      std::vector<Vector2d> again = corners;
      std::rotate(again.begin(), again.begin() + static_cast<std::ptrdiff_t>(shift), again.end());
      if (back) std::reverse(again.begin(), again.end());
      const Outlines found = find_outlines({polygon(1, corners), polygon(2, again), square(3, 20, 20, 10)}, {}, 0);
      ASSERT_EQ(found.panels.size(), 1u) << shift << back;
      expect_near_rel(area(found.panels[0]), twice / 2 - 100, 1e-13);
      ASSERT_EQ(found.notes.size(), 1u) << shift << back;
      EXPECT_EQ(found.notes[0].id, 2);
      EXPECT_NE(found.notes[0].what.find("repeats the outline of entity 1"), std::string::npos) << found.notes[0].what;
    }
  }
  // A hole drawn twice is one, and a like outline beside it a panel of its own.
  const Outlines holes =
      find_outlines({square(1, 0, 0, 10), square(2, 2, 2, 3), square(3, 2, 2, 3), square(4, 20, 0, 10)}, {}, 0);
  ASSERT_EQ(holes.panels.size(), 2u);
  expect_near_rel(area(holes.panels[0]), 91, 1e-14);
}

TEST(Outlines, LooseEndsAndForksAreReported) {
  LooseCurve open = square(1, 0, 0, 10);
  open.pieces.pop_back();
  Outlines found = find_outlines({open, square(2, 20, 0, 10)}, {}, 0);
  EXPECT_EQ(found.panels.size(), 1u);
  EXPECT_FALSE(found.notes.empty());
  // A line between two corners: which of the three chains is the outline?
  LooseCurve forked = square(1, 0, 0, 10);
  forked.pieces.push_back(line_segment<3>({0, 0, 0}, {10, 10, 0}));
  found = find_outlines({forked}, {}, 0);
  EXPECT_TRUE(found.panels.empty());
  ASSERT_FALSE(found.notes.empty());
  EXPECT_NE(found.notes[0].what.find("several curves go on from"), std::string::npos);
  EXPECT_TRUE(find_outlines({}, {}, 0).panels.empty());
  // Squares that share a corner are each one entity: no doubt.
  EXPECT_EQ(find_outlines({square(1, 0, 0, 10), square(2, 10, 10, 5)}, {}, 0).panels.size(), 2u);
}

TEST(Outlines, EndsAreJoinedWithinTheTolerance) {
  LooseCurve gappy = square(1, 0, 0, 10);
  gappy.pieces[1] = line_segment<3>({10.00001, 0, 0}, {10, 10.00001, 0});
  const Outlines found = find_outlines({gappy}, {}, 0);
  ASSERT_EQ(found.panels.size(), 1u);
  TrimmedSurface face = found.panels[0];
  EXPECT_FALSE(validate_loops(face).empty()) << "the gap is closed in the open";
}

}  // namespace
}  // namespace toile
