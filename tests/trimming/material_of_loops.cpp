// SPDX-License-Identifier: GPL-3.0-or-later
// Loops that cross, share pieces or run out and back: what they bound, and that nothing else changes.
#include <algorithm>

#include "geometry/error.h"
#include "trimming/material.h"
#include "trims.h"

namespace toile::test {
namespace {

// Corners (x, y) of a rectangle, counter-clockwise.
std::vector<Vector2d> box(double x0, double y0, double x1, double y1) {
  return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

TrimmedSurface with_holes(TrimLoop outer, const std::vector<TrimLoop>& holes) {
  std::vector<TrimLoop> loops{std::move(outer)};
  for (const TrimLoop& hole : holes) loops.push_back(backwards(hole));
  return trimmed(unit_cells(4), loops);
}

// Validated, with all laws of its trace, in every orientation of the given loops.
struct Facts {
  double area = 0;
  std::size_t loops = 0;
  std::vector<PanelMark> marks;
  std::vector<std::string> said;
  TrimmedSurface face;
};
Facts facts(TrimmedSurface given) {
  Facts out;
  for (int turned = 0; turned < 2; ++turned) {
    TrimmedSurface face = given;
    if (turned == 1)
      for (TrimLoop& loop : face.loops) loop = backwards(loop);
    const auto repairs = validate_loops(face);
    expect_laws(face, trace_trims(face));
    EXPECT_TRUE(turned == 0 || std::abs(loop_area(face) - out.area) < 1e-12) << "depends on the loops' directions";
    out.area = loop_area(face);
    if (turned == 1) continue;
    out.loops = face.loops.size();
    out.marks = face.marks;
    for (const LoopRepair& r : repairs) out.said.push_back(r.what);
    out.face = face;
  }
  return out;
}

std::vector<int> numbers(const TrimLoop& loop) {
  std::vector<int> out;
  for (const TrimCurve& c : loop.curves) out.push_back(c.index);
  return out;
}

std::string refusal(TrimmedSurface face) {
  try {
    validate_loops(face);
  } catch (const GeometryError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(Material, AHoleThatSharesAnEdgePieceIsANotch) {
  const Facts f = facts(with_holes(polygon_loop(box(0, 0, 4, 3)), {polygon_loop(box(1, 0, 2, 1))}));
  EXPECT_EQ(f.loops, 1u);
  expect_near_rel(f.area, 11, 1e-14);
  EXPECT_FALSE(f.said.empty());
  // The outer loop's first curve is in two pieces; the hole's curves (1 to 3, its edge 0 is gone) follow on 0 to 3.
  std::vector<int> n = numbers(f.face.loops[0]);
  std::ranges::sort(n);
  EXPECT_EQ(n, (std::vector<int>{0, 0, 1, 2, 3, 5, 6, 7}));
}

TEST(Material, PiecesKeepTheirParameters) {
  const TrimmedSurface given = with_holes(polygon_loop(box(0, 0, 4, 3)), {polygon_loop(box(1, 0, 2, 1))});
  const Facts f = facts(given);
  for (const TrimCurve& c : f.face.loops[0].curves) {
    const TrimLoop& from = given.loops[c.index < 4 ? 0 : 1];
    const auto source = std::ranges::find(from.curves, c.index % 4, &TrimCurve::index);
    for (const double s : {0.0, 0.3, 1.0}) {
      const double t = c.curve.domain().min + s * c.curve.domain().length();
      EXPECT_LT((c.curve(t) - source->curve(t)).norm(), 1e-14);
    }
  }
}

// From a billionth to the whole way out.
TEST(Material, AHoleThatPokesOutIsCutOff) {
  for (const double out : {1e-9, 1e-7, 1e-4, 0.01, 0.3, 0.5, 0.9}) {
    SCOPED_TRACE(out);
    const Facts f = facts(with_holes(polygon_loop(box(0, 1, 4, 4)), {polygon_loop(box(1, 1 - out, 2, 2 - out))}));
    EXPECT_EQ(f.loops, 1u);
    expect_near_rel(f.area, 12 - (1 - out), 1e-9);
    // A circle, at a corner and on an edge: by its segment and its quarter.
    const double r = 0.5, d = r - out, h = std::abs(d) < r ? std::sqrt(r * r - d * d) : 0;
    const double within = M_PI * r * r - (r * r * std::acos(d / r) - d * h);
    const Facts round = facts(with_holes(polygon_loop(box(0, 1, 4, 4)), {loop_of({round_curve({2, 1.5 - out}, r)})}));
    EXPECT_EQ(round.loops, 1u);
    expect_near_rel(round.area, 12 - within, 1e-9);
  }
  const Facts corner = facts(with_holes(polygon_loop(box(1, 1, 4, 4)), {loop_of({round_curve({1, 1}, 0.5)})}));
  expect_near_rel(corner.area, 9 - M_PI / 16, 1e-13);
  EXPECT_EQ(corner.loops, 1u);
}

TEST(Material, HolesThatCrossOrShareAnEdgeAreOne) {
  const Facts crossing = facts(with_holes(polygon_loop(box(0, 0, 4, 4)),
                                          {polygon_loop(box(1, 1, 2, 2)), polygon_loop(box(1.5, 1.5, 2.5, 2.5))}));
  EXPECT_EQ(crossing.loops, 2u);
  expect_near_rel(crossing.area, 16 - 1.75, 1e-14);
  const Facts beside = facts(
      with_holes(polygon_loop(box(0, 0, 4, 4)), {polygon_loop(box(1, 1, 2, 2)), polygon_loop(box(2, 1.25, 3, 2.5))}));
  EXPECT_EQ(beside.loops, 2u);
  expect_near_rel(beside.area, 16 - 2.25, 1e-14);
  const Facts twice =
      facts(with_holes(polygon_loop(box(0, 0, 4, 4)), {polygon_loop(box(1, 1, 2, 2)), polygon_loop(box(1, 1, 2, 2))}));
  EXPECT_EQ(twice.loops, 2u);
  expect_near_rel(twice.area, 15, 1e-14);
  // Three discs in a row, the last over the border.
  const Facts chain = facts(with_holes(
      polygon_loop(box(0, 0, 4, 4)),
      {loop_of({round_curve({2, 2}, 0.6)}), loop_of({round_curve({3, 2}, 0.6)}), loop_of({round_curve({4, 2}, 0.6)})}));
  const double lens = 2 * 0.36 * std::acos(0.5 / 0.6) - std::sqrt(0.36 - 0.25);
  EXPECT_EQ(chain.loops, 1u);
  expect_near_rel(chain.area, 16 - 2.5 * M_PI * 0.36 + 2 * lens, 1e-12);
}

// The same spline once in the outer loop and once in the hole, run the other way.
TEST(Material, ACurvedEdgeMayBeShared) {
  const Curve2 arch = bezier_curve({{1, 1}, {2, 0.25}, {3, 0.5}, {3.5, 1}});
  const TrimLoop outer = loop_of(
      {arch, line_segment<2>({3.5, 1}, {3.5, 3}), line_segment<2>({3.5, 3}, {1, 3}), line_segment<2>({1, 3}, {1, 1})});
  TrimLoop hole = loop_of({backwards(arch), line_segment<2>({1, 1}, {1.5, 2}), line_segment<2>({1.5, 2}, {3.5, 1})});
  const Facts f = facts(with_holes(outer, {hole}));
  EXPECT_EQ(f.loops, 1u);
  // What is left is the polygon above the hole's two straight sides.
  expect_near_rel(f.area, 5 - 0.5 * (2.5 * 1), 1e-13);
}

TEST(Material, TheHoleMayBeAroundTheOuterLoop) {
  // Sharing an edge piece: what the file calls outer is then the hole.
  const Facts f = facts(with_holes(polygon_loop(box(1, 0, 2, 1)), {polygon_loop(box(0, 0, 4, 3))}));
  expect_near_rel(f.area, 11, 1e-14);
}

TEST(Material, RefusesWhereNothingIsLeftOrTheHolePartsThePanel) {
  EXPECT_NE(refusal(with_holes(polygon_loop(box(1, 1, 3, 3)), {polygon_loop(box(1, 1, 3, 3))})).find("nothing is left"),
            std::string::npos);
  const std::string again = refusal(with_holes(polygon_loop(box(1, 1, 3, 3)), {polygon_loop(box(1, 1, 3, 3))}));
  EXPECT_NE(again.find("less than 4e-10 apart; the file's resolution is"), std::string::npos) << again;
  const std::string parted = refusal(with_holes(polygon_loop(box(0, 1, 4, 3)), {polygon_loop(box(1, 0, 2, 4))}));
  EXPECT_NE(parted.find("2 pieces"), std::string::npos) << parted;
  EXPECT_NE(parted.find("(u, v) = (1, "), std::string::npos) << parted;
}

TEST(Material, PanelsOfLoopsOfUnknownKind) {
  const auto panels = [](const std::vector<TrimLoop>& loops, bool known) {
    return material_of(loops, {known, {1e-10, 1e-10}});
  };
  // A strip cut right through.
  EXPECT_EQ(panels({polygon_loop(box(0, 1, 4, 3)), polygon_loop(box(1, 0, 2, 4))}, true).panels.size(), 2u);
  EXPECT_THROW(panels({polygon_loop(box(0, 1, 4, 3)), polygon_loop(box(1, 0, 2, 4))}, false), GeometryError);
  // Within each other: a hole, and an island in it.
  const Material nested =
      panels({polygon_loop(box(0, 0, 4, 4)), polygon_loop(box(1, 1, 3, 3)), polygon_loop(box(1.5, 1.5, 2, 2))}, false);
  ASSERT_EQ(nested.panels.size(), 2u);
  EXPECT_EQ(nested.panels[0].source, (std::vector<int>{0, 1}));
  EXPECT_EQ(nested.panels[1].source, (std::vector<int>{2}));
  // Sharing an edge: within, a notch; beside each other, a panel each.
  EXPECT_EQ(panels({polygon_loop(box(1, 0, 2, 1)), polygon_loop(box(0, 0, 4, 4))}, false).panels.size(), 1u);
  EXPECT_EQ(panels({polygon_loop(box(0, 0, 1, 1)), polygon_loop(box(1, 0, 2, 1))}, false).panels.size(), 2u);
}

// Fits leave curves whose points differ by their last bit: in units of the tolerance they may be one point.
TEST(Material, ACurveOfOneRoundingIsAPoint) {
  for (int k = 1; k <= 100; ++k) {
    const Vector2d corner(3 + 0.003 * k, 1.5 + 0.0013 * k);
    const Vector2d beside(corner.x(), std::nextafter(corner.y(), 2 * corner.y()));
    const TrimLoop outer = loop_of({line_segment<2>({0, corner.y()}, corner), bezier_curve({corner, beside, beside}),
                                    line_segment<2>(beside, {corner.x(), 4}), line_segment<2>({corner.x(), 4}, {0, 4}),
                                    line_segment<2>({0, 4}, {0, corner.y()})});
    const Material material =
        material_of({outer, backwards(polygon_loop(box(0, 2, 1, 3)))}, {true, {1 / 1.2e7, 1 / 1.2e7}});
    ASSERT_EQ(material.panels.size(), 1u) << k;
    EXPECT_EQ(material.panels[0].loops.size(), 1u) << k;
  }
}

TEST(Material, AHoleBesideTheOuterLoopIsLeftOut) {
  for (const double x : {1.5, 1.0}) {  // apart, and sharing an edge
    SCOPED_TRACE(x);
    std::vector<TrimLoop> loops{polygon_loop(box(0, 0, 1, 1)), polygon_loop(box(x, 0, x + 1, 1))};
    loops[1].index = 1;
    const Material m = material_of(loops, {true, {1e-10, 1e-10}});
    ASSERT_EQ(m.panels.size(), 1u);
    EXPECT_EQ(m.idle, std::vector<int>{1});
    ASSERT_EQ(m.changes.size(), 1u);
    EXPECT_NE(m.changes[0].what.find("left out"), std::string::npos);
    EXPECT_EQ(m.changes[0].place, Vector2d(x, 0));
  }
  // Around a loop of its own it is another outer loop.
  const Material two =
      material_of({polygon_loop(box(0, 0, 1, 1)), polygon_loop(box(1.5, 0, 3.5, 2)), polygon_loop(box(2, 1, 3, 1.5))},
                  {true, {1e-10, 1e-10}});
  EXPECT_EQ(two.panels.size(), 2u);
  EXPECT_TRUE(two.idle.empty());
}

TEST(Material, AnEdgeRunOutAndBackIsASlit) {
  const Facts f = facts(with_holes(polygon_loop({{0, 0}, {4, 0}, {4, 2}, {2.5, 2}, {4, 2}, {4, 4}, {0, 4}}), {}));
  EXPECT_EQ(f.loops, 1u);
  expect_near_rel(f.area, 16, 1e-14);
  ASSERT_EQ(f.marks.size(), 1u);
  EXPECT_EQ(f.marks[0].kind, MarkKind::slit);
  EXPECT_TRUE(f.marks[0].text.empty());
  ASSERT_TRUE(f.marks[0].curve);
  EXPECT_EQ(f.marks[0].curve->start(), Vector2d(4, 2));
  EXPECT_EQ(f.marks[0].curve->end(), Vector2d(2.5, 2));
  // Curved, and not at a joint of the curves it leaves.
  const Curve2 dart = bezier_curve({{2, 0}, {2.25, 1}, {1.75, 2}, {2, 3}});
  TrimLoop loop =
      loop_of({line_segment<2>({0, 0}, {2, 0}), dart, dart, line_segment<2>({2, 0}, {4, 0}),
               line_segment<2>({4, 0}, {4, 4}), line_segment<2>({4, 4}, {0, 4}), line_segment<2>({0, 4}, {0, 0})});
  loop.curves[2].reversed = true;
  const Facts curved = facts(with_holes(loop, {}));
  expect_near_rel(curved.area, 16, 1e-14);
  ASSERT_EQ(curved.marks.size(), 1u);
  EXPECT_EQ(*curved.marks[0].curve, dart);
}

// A cut within a panel: a hole without area. It may lie by itself, begin on the outer loop, cross another hole.
TEST(Material, AHoleThatIsALineOutAndBackIsASlit) {
  const TrimLoop outer = polygon_loop(box(0, 0, 4, 4));
  const auto cut = [](const Vector2d& a, const Vector2d& b) { return polygon_loop({a, b}); };
  const Facts inside = facts(with_holes(outer, {cut({1, 1}, {3, 1.5})}));
  EXPECT_EQ(inside.loops, 1u);
  expect_near_rel(inside.area, 16, 1e-14);
  ASSERT_EQ(inside.marks.size(), 1u);
  EXPECT_EQ(inside.marks[0].kind, MarkKind::slit);
  EXPECT_TRUE(inside.marks[0].text.empty());
  EXPECT_NEAR(inside.marks[0].curve->start().x() + inside.marks[0].curve->end().x(), 4, 1e-15);
  ASSERT_EQ(inside.said.size(), 1u);
  EXPECT_NE(inside.said[0].find("a slit"), std::string::npos);

  const Facts from_border = facts(with_holes(outer, {cut({2, 0}, {2, 1.25})}));
  expect_near_rel(from_border.area, 16, 1e-14);
  EXPECT_EQ(from_border.marks.size(), 1u);

  const Facts beside =
      facts(with_holes(outer, {cut({1, 1}, {1, 2}), polygon_loop(box(2, 2, 3, 3)), cut({2.5, 1}, {2.5, 2.25})}));
  EXPECT_EQ(beside.loops, 2u);
  expect_near_rel(beside.area, 15, 1e-14);
  EXPECT_EQ(beside.marks.size(), 2u);  // the part inside the hole is left out

  EXPECT_NE(refusal(with_holes(cut({1, 1}, {3, 1}), {})).find("loop 0 bounds nothing"), std::string::npos);
}

TEST(Material, ASpikeOutsideIsLeftOut) {
  const Facts f = facts(with_holes(polygon_loop({{1, 1}, {3, 1}, {3, 2}, {4, 2}, {3, 2}, {3, 3}, {1, 3}}), {}));
  EXPECT_TRUE(f.marks.empty());
  expect_near_rel(f.area, 4, 1e-14);
  EXPECT_EQ(std::ranges::count_if(f.said, [](const std::string& s) { return s.find("left out") != s.npos; }), 1);
}

TEST(Material, AKeyholeIsAHoleAndItsBridgeAMark) {
  const Facts f = facts(with_holes(
      polygon_loop({{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 2}, {1, 2}, {1, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}),
      {}));
  EXPECT_EQ(f.loops, 2u);
  expect_near_rel(f.area, 14, 1e-14);
  ASSERT_EQ(f.marks.size(), 1u);
  EXPECT_EQ(f.marks[0].text, "bridge");
  EXPECT_EQ(f.face.loops[0].index, 0);
  EXPECT_EQ(f.face.loops[1].index, 1);
  EXPECT_EQ(f.face.loops[1].kind, LoopKind::hole);
}

TEST(Material, UntouchedLoopsStayBitForBit) {
  TrimmedSurface given = with_holes(
      polygon_loop(box(0, 0, 4, 4)),
      {loop_of({round_curve({1, 1}, 0.4)}), polygon_loop(box(3, 3, 3.5, 3.5)), polygon_loop(box(2, 0, 3, 1))});
  const Facts f = facts(given);
  ASSERT_EQ(f.loops, 3u);
  for (const std::size_t l : {1u, 2u}) {
    const auto now = std::ranges::find(f.face.loops, static_cast<int>(l), &TrimLoop::index);
    ASSERT_NE(now, f.face.loops.end());
    for (std::size_t c = 0; c < now->curves.size(); ++c)
      EXPECT_EQ(now->curves[c].curve, given.loops[l].curves[c].curve);
  }
}

TEST(Material, ACrossingInAJointIsCutThere) {
  const std::vector<Vector2d> corners = {{1, 1}, {3, 1}, {3, 2}, {3, 3}, {1, 3}};
  for (const bool weighted : {false, true}) {
    std::vector<Curve2> outline;
    for (std::size_t k = 0; k < corners.size(); ++k)
      outline.push_back(bezier_curve({corners[k], corners[(k + 1) % corners.size()]},
                                     weighted ? std::vector<double>{1, 8} : std::vector<double>{}));
    const Facts f = facts(with_holes(loop_of(outline), {polygon_loop(box(2, 2, 3.5, 2.5))}));
    expect_near_rel(f.area, 3.5, 1e-14);
  }
}

}  // namespace
}  // namespace toile::test
