// SPDX-License-Identifier: GPL-3.0-or-later
// What validation repairs, reports and refuses.
#include <limits>

#include "geometry/error.h"
#include "trims.h"

namespace toile::test {
namespace {

const std::vector<Vector2d> square = {{0.5, 0.5}, {3.5, 0.5}, {3.5, 3.5}, {0.5, 3.5}};

TrimmedSurface with_outline(TrimLoop loop) {
  return trimmed(unit_cells(4), {std::move(loop)});
}

void expect_error(TrimmedSurface surface, const std::vector<std::string>& parts) {
  try {
    validate_loops(surface);
    FAIL() << "accepted, expected: " << parts.front();
  } catch (const GeometryError& e) {
    for (const std::string& part : parts) EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
  }
}

bool reports(const std::vector<LoopRepair>& repairs, const std::string& what) {
  return std::any_of(repairs.begin(), repairs.end(),
                     [&](const LoopRepair& r) { return r.what.find(what) != std::string::npos; });
}

TEST(LoopValidation, LeavesGoodLoopsAlone) {
  for (const TrimLoop& loop :
       {polygon_loop(square), loop_of({round_curve({2, 2}, 1.5)}), loop_of({round_curve({2, 2}, 2)})}) {
    TrimmedSurface face = with_outline(loop);
    EXPECT_TRUE(validate_loops(face).empty());
    EXPECT_EQ(face.loops[0].gap, 0);
    for (std::size_t c = 0; c < loop.curves.size(); ++c) EXPECT_EQ(face.loops[0].curves[c].curve, loop.curves[c].curve);
  }
}

TEST(LoopValidation, OrientsByArea) {
  TrimmedSurface face = with_outline(backwards(polygon_loop(square)));
  face.loops.push_back(loop_of({round_curve({2, 2}, 0.5)}, LoopKind::hole));
  face.loops[1].index = 1;
  const auto repairs = validate_loops(face);
  ASSERT_EQ(repairs.size(), 2u);
  EXPECT_EQ(repairs[0].what, "reversed");
  EXPECT_EQ(repairs[1].loop, 1);
  expect_near_rel(loop_area(face), 9 - M_PI / 4, 1e-13);
  EXPECT_TRUE(validate_loops(face).empty());
}

TEST(LoopValidation, TurnsCurvesThatChainOnlyTheOtherWay) {
  TrimLoop loop = polygon_loop(square);
  loop.curves[1].curve = backwards(loop.curves[1].curve);
  loop.curves[0].curve = backwards(loop.curves[0].curve);
  TrimmedSurface face = with_outline(loop);
  const auto repairs = validate_loops(face);
  EXPECT_EQ(repairs.size(), 2u);
  EXPECT_TRUE(reports(repairs, "turned curve 1"));
  EXPECT_TRUE(face.loops[0].curves[1].reversed);
  expect_laws(face, trace_trims(face));
}

TEST(LoopValidation, ClosesSmallGapsAndSaysSo) {
  TrimLoop loop = polygon_loop(square);
  loop.curves[2].curve = line_segment<2>({3.5 + 3e-4, 3.5 - 4e-4}, {0.5, 3.5});
  TrimmedSurface face = with_outline(loop);
  const auto repairs = validate_loops(face);
  ASSERT_EQ(repairs.size(), 1u);
  EXPECT_TRUE(reports(repairs, "closed a gap of 0.0005"));
  expect_near_rel(face.loops[0].gap, 5e-4, 1e-9);
  EXPECT_LE(repairs[0].move, 5e-4);
  // The side before runs along u = 3.5, the side after does not run along v: the joint keeps u of the first.
  EXPECT_EQ(face.loops[0].curves[1].curve.end(), face.loops[0].curves[2].curve.start());
  EXPECT_EQ(face.loops[0].curves[1].curve.end().x(), 3.5);
  expect_laws(face, trace_trims(face));
}

TEST(LoopValidation, RefusesOpenLoops) {
  TrimLoop loop = polygon_loop(square);
  loop.curves[2].curve = line_segment<2>({3.4, 3.5}, {0.5, 3.5});
  expect_error(with_outline(loop), {"panel 'panel', loop 0, curve 1: ", "open", "(u, v) = (3.5, 3.5)"});
  TrimLoop single = loop_of({bezier_curve({{1, 1}, {3, 1}, {2, 3}})});
  expect_error(with_outline(single), {"loop 0, curve 0", "open"});
}

TEST(LoopValidation, RefusesAFigureEight) {
  expect_error(with_outline(polygon_loop({{1, 1}, {3, 3}, {3, 1}, {1, 3}})),
               {"panel 'panel', loop 0, curve", "crosses curve", "(u, v) = (2, 2)"});
  // Curved.
  expect_error(with_outline(loop_of({bezier_curve({{1, 1}, {2.5, 2}, {3, 3}}), bezier_curve({{3, 3}, {3.5, 2}, {3, 1}}),
                                     bezier_curve({{3, 1}, {2, 1.5}, {1, 3}}), line_segment<2>({1, 3}, {1, 1})})),
               {"loop 0, curve", "crosses curve"});
  // A loop within one span.
  expect_error(
      with_outline(loop_of({bezier_curve({{1, 1}, {6, 4}, {-2, 4}, {3, 1}}), line_segment<2>({3, 1}, {1, 1})})),
      {"loop 0, curve 0: crosses"});
}

TEST(LoopValidation, ACuspIsNoCrossing) {
  TrimmedSurface face =
      with_outline(loop_of({bezier_curve({{1, 1}, {4, 3}, {4, 1}, {1, 3}}), line_segment<2>({1, 3}, {1, 1})}));
  EXPECT_TRUE(validate_loops(face).empty());
  expect_laws(face, trace_trims(face));
}

TEST(LoopValidation, RefusesHolesOutside) {
  TrimmedSurface face = trimmed(
      unit_cells(4), {polygon_loop({{1, 1}, {2, 1}, {2, 2}, {1, 2}}), backwards(loop_of({round_curve({3, 3}, 0.5)}))});
  expect_error(face, {"panel 'panel', loop 1", "outside the outer loop"});
}

TEST(LoopValidation, RefusesHolesInHoles) {
  TrimmedSurface face = trimmed(unit_cells(4), {polygon_loop(square), backwards(loop_of({round_curve({2, 2}, 1)})),
                                                backwards(loop_of({round_curve({2, 2}, 0.5)}))});
  expect_error(face, {"loop 2", "inside loop 1"});
}

TEST(LoopValidation, ReportsTouchesAndKeepsThem) {
  TrimmedSurface face = trimmed(unit_cells(4), {polygon_loop(square), backwards(loop_of({round_curve({3, 2}, 0.5)}))});
  const auto repairs = validate_loops(face);
  ASSERT_EQ(repairs.size(), 1u);
  EXPECT_TRUE(reports(repairs, "touches"));
  expect_laws(face, trace_trims(face));
}

TEST(LoopValidation, NearMissesAreNoContacts) {
  for (const double gap : {1e-3, 1e-8, 1e-12}) {
    TrimmedSurface face =
        trimmed(unit_cells(4), {polygon_loop(square), backwards(loop_of({round_curve({3 - gap, 2}, 0.5)}))});
    EXPECT_TRUE(validate_loops(face).empty()) << gap;
  }
  // Two arcs of nearly one curvature, 1e-10 apart all along.
  TrimmedSurface lune = with_outline(loop_of(
      {bezier_curve({{1, 1}, {2, 0.5}, {3, 1}}), line_segment<2>({3, 1}, {3, 1 + 1e-10}),
       bezier_curve({{3, 1 + 1e-10}, {2, 0.5 + 1e-10}, {1, 1 + 1e-10}}), line_segment<2>({1, 1 + 1e-10}, {1, 1})}));
  EXPECT_TRUE(validate_loops(lune).empty());
  expect_laws(lune, trace_trims(lune));
}

TEST(LoopValidation, MovesSmallExcursionsIntoTheDomain) {
  TrimmedSurface face = with_outline(polygon_loop({{-1e-3, 0}, {4, 0}, {4, 4}, {-1e-3, 4}}));
  const auto repairs = validate_loops(face);
  EXPECT_TRUE(reports(repairs, "into the domain"));
  expect_laws(face, trace_trims(face));
  expect_near_rel(loop_area(face), 16, 1e-14);
  expect_error(with_outline(polygon_loop({{-0.1, 0}, {4, 0}, {4, 4}, {0, 4}})),
               {"loop 0, curve", "leaves the domain by 0.1", "(-0.1, 0)"});
  // Control points outside don't matter where the curve stays within.
  TrimmedSurface hull = with_outline(loop_of(
      {bezier_curve({{1, 1}, {2, -0.5}, {3, 1}}), line_segment<2>({3, 1}, {2, 3}), line_segment<2>({2, 3}, {1, 1})}));
  EXPECT_TRUE(validate_loops(hull).empty());
}

// A line runs into an arc that turns back along it, as fillets do in files of nine digits: within rounding the two meet
// again next to their joint.
TEST(LoopValidation, ACuspOfRoundedNumbersIsNoCrossing) {
  int accepted = 0;
  for (const double off : {-3e-10, -1e-10, 0.0, 1e-10, 3e-10}) {
    TrimmedSurface face = with_outline(
        loop_of({line_segment<2>({1, 1}, {3, 1.5}), bezier_curve({{3, 1.5}, {2.75, 1.4375 + off}, {2.5, 1.7}}),
                 line_segment<2>({2.5, 1.7}, {2, 3}), line_segment<2>({2, 3}, {1, 1})}));
    validate_loops(face);
    expect_laws(face, trace_trims(face));
    ++accepted;
  }
  EXPECT_EQ(accepted, 5);
}

// Leaves by 3e-28 near its start: no double between two samples shows it.
// A cubic that comes to (3, 3) along the line x = 3 and, by `beyond`, from its far side; then back along that line.
TrimmedSurface cusp(double beyond, double resolution) {
  TrimmedSurface face =
      trimmed(unit_cells(4),
              {loop_of({bezier_curve({{1, 1}, {2.5, 1}, {3 + beyond, 2}, {3, 3}}), line_segment<2>({3, 3}, {3, 0.5}),
                        line_segment<2>({3, 0.5}, {1, 0.5}), line_segment<2>({1, 0.5}, {1, 1})})});
  face.resolution = resolution;
  return face;
}

TEST(LoopValidation, ATipBeyondACrossingOfNeighboursIsCutOff) {
  for (const double beyond : {1e-3, 1e-2, 3e-2}) {
    SCOPED_TRACE(beyond);
    // With s = 1 - t the cubic lies 3 - x = s (2 s^2 + 1.5 s (1 - s) - 3 beyond (1 - s)^2) from the line.
    const double a = 0.5 - 3 * beyond, b = 1.5 + 6 * beyond, c = -3 * beyond;
    const double s = (-b + std::sqrt(b * b - 4 * a * c)) / (2 * a), t = 1 - s;
    TrimmedSurface face = cusp(beyond, beyond * beyond);
    const auto repairs = validate_loops(face);
    ASSERT_EQ(face.loops.size(), 1u);
    ASSERT_EQ(face.loops[0].curves.size(), 4u);
    EXPECT_TRUE(reports(repairs, "the tip beyond"));
    const auto cubic = std::ranges::find(face.loops[0].curves, 0, &TrimCurve::index);
    EXPECT_NEAR(cubic->curve.domain().max, t, 1e-9);
    EXPECT_EQ(cubic->curve.points()(0, 3), 3);  // bitwise on the line
    const Curve2 whole = bezier_curve({{1, 1}, {2.5, 1}, {3 + beyond, 2}, {3, 3}});
    EXPECT_NEAR(cubic->curve.end().y(), whole(t).y(), 1e-9);
    expect_laws(face, trace_trims(face));
    // No wider than that.
    expect_error(cusp(beyond, 0.01 * beyond * beyond), {"crosses"});
  }
}

// An edge of constant v, and back beside it a spline whose first leg lies on it but for rounding: next to their joint
// they cross. (Inches, as a public file has them.)
TEST(LoopValidation, ACuspOnALevelEdgeIsNoCrossing) {
  Curve2::Points points(2, 10);
  points << 0.34231899982844, 0.343953138816291, 0.345881217468119, 0.348844890910404, 0.350421657488232,
      0.35261153191199, 0.353633248209765, 0.354782017913083, 0.355131797720779, 0.355131797720779, 0,
      1.6960641916319e-15, -0.00035763591247111, -0.00152888656649212, -0.00252132860630046, -0.00461355854379018,
      -0.00606052606208017, -0.00872045392518006, -0.0103897408019426, -0.0118110236220473;
  const double a = 0.139956574171473, b = 0.152408713258907, c = 0.164239385364182, d = 0.175487347396243,
               e = 0.186317522485449;
  const Curve2 back(KnotVector(3, {a, a, a, a, b, b, c, c, d, d, e, e, e, e}), points);
  TrimmedSurface face = trimmed(
      knot_plane({0.3, 0.4}, {-0.05, 0.05}),
      {loop_of({line_segment<2>({0.344514098097419, 0}, {0.342318999828425, 0}), back,
                line_segment<2>({0.355131797720779, -0.0118110236220473}, {0.36, -0.0118}),
                line_segment<2>({0.36, -0.0118}, {0.36, 0}), line_segment<2>({0.36, 0}, {0.344514098097419, 0})})});
  validate_loops(face);
  expect_laws(face, trace_trims(face));
}

TEST(LoopValidation, MovesAnExcursionIntoTheDomainThatNoSampleShows) {
  TrimmedSurface face =
      with_outline(loop_of({bezier_curve({{1, 0}, {2, -1e-14}, {2.5, 2}, {3, 0}}), line_segment<2>({3, 0}, {3, 4}),
                            line_segment<2>({3, 4}, {1, 4}), line_segment<2>({1, 4}, {1, 0})}));
  EXPECT_TRUE(reports(validate_loops(face), "into the domain"));
  expect_laws(face, trace_trims(face));
}

// Beyond the border by 1e-16 between two samples: (s - 0.3)^2, all but.
TEST(LoopValidation, MovesATouchBeyondTheBorderIntoTheDomain) {
  TrimmedSurface face = with_outline(
      loop_of({bezier_curve({{1, 0.09}, {2, -0.21 * (1 + 1e-15)}, {3, 0.49}}), line_segment<2>({3, 0.49}, {3, 4}),
               line_segment<2>({3, 4}, {1, 4}), line_segment<2>({1, 4}, {1, 0.09})}));
  EXPECT_TRUE(reports(validate_loops(face), "into the domain"));
  expect_laws(face, trace_trims(face));
}

// The curve touches v = 0 from within while its net goes beyond; what snaps its ends to v = 0 takes it out.
TEST(LoopValidation, WhatSnapsStaysInTheDomain) {
  const double d = 5e-7, e = 2e-6, g = (d + 4 * e) / 3;
  TrimmedSurface face = with_outline(
      loop_of({bezier_curve({{1, d}, {1.5, e}, {2, -g}, {2.5, e}, {3, d}}), line_segment<2>({3, d}, {3, 4}),
               line_segment<2>({3, 4}, {1, 4}), line_segment<2>({1, 4}, {1, d})}));
  face.resolution = 1e-6;
  EXPECT_TRUE(reports(validate_loops(face), "snapped curve 0 to v = 0"));
  expect_laws(face, trace_trims(face));
}

TEST(LoopValidation, SnapsToKnotLinesWithinTheResolution) {
  TrimmedSurface face = with_outline(polygon_loop({{1 + 1e-9, 1}, {3, 1 - 1e-9}, {3, 3}, {1, 3}}));
  face.resolution = 1e-8;
  const auto repairs = validate_loops(face);
  EXPECT_TRUE(reports(repairs, "snapped curve 0 to u = 1"));
  const Tally t = tally(trace_trims(face));
  EXPECT_EQ(t.cut, 0);
  EXPECT_EQ(t.inside, 4);
  EXPECT_EQ(t.crossing_uv, 8);
  // Not further than that.
  TrimmedSurface sliver = with_outline(polygon_loop({{1 + 1e-7, 1}, {3, 1}, {3, 3}, {1 + 1e-7, 3}}));
  sliver.resolution = 1e-8;
  EXPECT_TRUE(validate_loops(sliver).empty());
}

TEST(LoopValidation, NeedsOneOuterLoop) {
  TrimmedSurface face = trimmed(unit_cells(4), {polygon_loop(square)});
  face.loops[0].kind = LoopKind::hole;
  expect_error(face, {"panel 'panel': has no outer loop"});
  TrimmedSurface two =
      trimmed(unit_cells(4), {polygon_loop({{0, 0}, {1, 0}, {1, 1}}), polygon_loop({{2, 2}, {3, 2}, {3, 3}})});
  two.loops[1].kind = LoopKind::outer;
  expect_error(two, {"panel 'panel', loop 1: a second outer loop, beside loop 0", "(u, v) = (2, 2)"});
}

// The arc comes to (1, 0) along the side that leaves it upwards: a joint without an angle.
TEST(LoopValidation, AnArcMayArriveAlongTheNextSide) {
  TrimmedSurface face =
      trimmed(unit_cells(1), {loop_of({bezier_curve({{0, 0}, {1, 0x1p-30}, {1, 0}}), line_segment<2>({1, 0}, {1, 1}),
                                       line_segment<2>({1, 1}, {0, 1}), line_segment<2>({0, 1}, {0, 0})})});
  EXPECT_TRUE(validate_loops(face).empty());
}

// An inscribed square: every corner of the hole lies on the outline.
TEST(LoopValidation, AHoleMayTouchTheOutlineWithAllItsCorners) {
  TrimmedSurface face = trimmed(unit_cells(4), {polygon_loop({{0, 0}, {4, 0}, {4, 4}, {0, 4}}),
                                                backwards(polygon_loop({{2, 0}, {4, 2}, {2, 4}, {0, 2}}))});
  EXPECT_EQ(validate_loops(face).size(), 4u);
  const TrimTopology topology = trace_trims(face);
  expect_laws(face, topology);
  EXPECT_EQ(tally(topology).cut, 8);
}

TEST(LoopValidation, UnclampedCurvesGetTheirEnds) {
  // A closed uniform quadratic B-spline: its ends meet though no control point lies on it.
  std::vector<Vector2d> ring;
  for (int k = 0; k < 8; ++k)
    ring.emplace_back(2 + 1.5 * std::cos(k % 6 * M_PI / 3), 2 + 1.5 * std::sin(k % 6 * M_PI / 3));
  Curve2::Points points(2, 8);
  for (int k = 0; k < 8; ++k) points.col(k) = ring[static_cast<std::size_t>(k)];
  TrimmedSurface face = with_outline(loop_of({Curve2(KnotVector(2, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}), points)}));
  validate_loops(face);
  expect_laws(face, trace_trims(face));
}

// A hole whose parabola hangs down to v = 0.5, the lower edge of the square, or to one rounding above or below.
TrimmedSurface hanging_hole(double middle, bool in_two, bool turned) {
  std::vector<Curve2> curves;
  if (in_two) {
    curves.push_back(bezier_curve({{1, 1.5}, {1.5, middle}, {2, middle}}));
    curves.push_back(bezier_curve({{2, middle}, {2.5, middle}, {3, 1.5}}));
  } else {
    curves.push_back(bezier_curve({{1, 1.5}, {2, 2 * middle - 1.5}, {3, 1.5}}));
  }
  curves.push_back(line_segment<2>({3, 1.5}, {1, 1.5}));
  TrimmedSurface face = with_outline(polygon_loop(square));
  face.loops.push_back(loop_of(curves, LoopKind::hole));
  face.loops[1].index = 1;
  if (turned)
    for (TrimLoop& loop : face.loops)
      for (TrimCurve& c : loop.curves)
        c.curve = Curve2(c.curve.knots(), c.curve.points().colwise().reverse(), c.curve.weights());
  return face;
}

TEST(LoopValidation, ATouchOfAnEdgeIsToldFromACrossingAndFromNoneByOneRounding) {
  constexpr double rounding = std::numeric_limits<double>::epsilon() / 2;
  for (const bool in_two : {false, true})
    for (const bool turned : {false, true}) {
      SCOPED_TRACE(std::string(in_two ? "two curves" : "one curve") + (turned ? ", turned" : ""));
      TrimmedSurface touching = hanging_hole(0.5, in_two, turned);
      EXPECT_TRUE(reports(validate_loops(touching), "touches"));
      TrimmedSurface clear = hanging_hole(0.5 + rounding, in_two, turned);
      EXPECT_FALSE(reports(validate_loops(clear), "touches"));
      expect_error(hanging_hole(0.5 - rounding, in_two, turned), {"crosses"});
    }
}

}  // namespace
}  // namespace toile::test
