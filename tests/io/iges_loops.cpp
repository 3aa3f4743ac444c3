// SPDX-License-Identifier: GPL-3.0-or-later
// Loops that meet each other or the seam of a closed surface, from boundaries to panels.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "io/iges/face.h"
#include "io/iges/surfaces.h"
#include "support/near.h"
#include "trimming/loops.h"
#include "trimming/quadrature.h"
#include "trimming/topology.h"

namespace toile {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
constexpr double pi = std::numbers::pi;

iges::BoundaryCurves polygon(const std::vector<Vector2d>& corners) {
  iges::BoundaryCurves out;
  out.place = "here: ";
  for (std::size_t k = 0; k < corners.size(); ++k) {
    Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 2);
    points.topRows<2>() << corners[k], corners[(k + 1) % corners.size()];
    out.parameter.emplace_back(KnotVector(1, {0, 0, 1, 1}), points);
  }
  return out;
}

iges::BoundaryCurves rectangle(double u0, double v0, double u1, double v1) {
  return polygon({{u0, v0}, {u1, v0}, {u1, v1}, {u0, v1}});
}

struct Result {
  std::vector<TrimmedSurface> panels;
  double area = 0;
  std::vector<std::string> notes;
};

Result panels_of(NurbsSurface surface, std::vector<iges::BoundaryCurves> boundaries, bool outer_known = true) {
  Result out;
  iges::FaceOptions options;
  options.outer_known = outer_known;
  options.resolution = 1e-7;
  options.note = [&](const std::string&, const std::string& what) { out.notes.push_back(what); };
  iges::FileSurface base;
  base.surface = std::move(surface);
  out.panels = iges::make_faces(base, boundaries, options);
  for (TrimmedSurface& panel : out.panels) {
    panel.resolution = options.resolution;
    validate_loops(panel);
    out.area += measure(panel, trace_trims(panel)).area;
  }
  return out;
}

NurbsSurface plane() {
  Eigen::Matrix3Xd net(3, 4);
  net << 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0;
  return {KnotVector(1, {0, 0, 1, 1}), KnotVector(1, {0, 0, 1, 1}), net};
}

// All the way round in four quarters, u in [0, 4]; the quarters' ends are exact.
NurbsSurface tube(double radius, double height) {
  const double x[] = {1, 1, 0, -1, -1, -1, 0, 1, 1}, y[] = {0, 1, 1, 1, 0, -1, -1, -1, 0};
  Eigen::Matrix3Xd net(3, 18);
  std::vector<double> weights;
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 9; ++i) {
      net.col(i + 9 * j) << radius * x[i], radius * y[i], height * j;
      weights.push_back(i % 2 == 0 ? 1 : std::sqrt(0.5));
    }
  return {KnotVector(2, {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4}), KnotVector(1, {0, 0, 1, 1}), net, weights};
}

TEST(IgesLoops, AHoleOverTheSeamIsCutFromBothSidesOfIt) {
  for (const double period : {0.0, -4.0, 4.0}) {
    SCOPED_TRACE(period);
    // An eighth of the turn on either side of the seam: u = 0.5 and 3.5 by symmetry.
    const Result r = panels_of(tube(2, 3), {rectangle(0, 0, 4, 1), rectangle(3.5 + period, 0.25, 4.5 + period, 0.5)});
    ASSERT_EQ(r.panels.size(), 1u);
    EXPECT_EQ(r.panels[0].loops.size(), 1u);
    expect_near_rel(r.area, 2 * pi * 2 * 3 - 2 * 3 * 0.25 * (pi / 2), 1e-12);
    EXPECT_EQ(r.panels[0].surface.points(), tube(2, 3).points());
    // Both parts of the hole's edges 0 and 2 keep their number, which follows on the outer loop's.
    for (const int number : {4, 6})
      EXPECT_EQ(std::ranges::count(r.panels[0].loops[0].curves, number, &TrimCurve::index), 2);
  }
}

TEST(IgesLoops, AHoleThatReachesTheSeamIsCutFromOneSide) {
  const Result r = panels_of(tube(2, 3), {rectangle(0, 0, 4, 1), rectangle(3, 0.25, 4, 0.5)});
  ASSERT_EQ(r.panels.size(), 1u);
  expect_near_rel(r.area, 2 * pi * 2 * 3 - 2 * 3 * 0.25 * (pi / 2), 1e-12);
}

TEST(IgesLoops, AHoleOnTheBorderIsCutAway) {
  for (const double out : {0.0, 1e-12, 1e-9, 1e-3, 0.1}) {
    SCOPED_TRACE(out);
    const Result r = panels_of(plane(), {rectangle(0, 0, 1, 1), rectangle(0.25, -out, 0.5, 0.25)});
    ASSERT_EQ(r.panels.size(), 1u);
    EXPECT_EQ(r.panels[0].loops.size(), 1u);
    expect_near_rel(r.area, 1 - 0.25 * 0.25, 1e-11);
  }
}

TEST(IgesLoops, AHoleRightAcrossLeavesTwoPanels) {
  const Result r = panels_of(plane(), {rectangle(0, 0, 1, 1), rectangle(0.25, -0.1, 0.5, 1.1)});
  EXPECT_EQ(r.panels.size(), 2u);
  expect_near_rel(r.area, 0.75, 1e-13);
}

TEST(IgesLoops, AHoleBesideTheOuterLoopIsLeftOutWithItsPlace) {
  const Result r = panels_of(plane(), {rectangle(0.1, 0.1, 0.4, 0.9), rectangle(0.6, 0.2, 0.9, 0.9)});
  ASSERT_EQ(r.panels.size(), 1u);
  expect_near_rel(r.area, 0.3 * 0.8, 1e-13);
  ASSERT_EQ(r.notes.size(), 1u);
  EXPECT_NE(r.notes[0].find("takes nothing away; it is left out"), std::string::npos) << r.notes[0];
  EXPECT_NE(r.notes[0].find("(at 0.6, 0.2)"), std::string::npos) << r.notes[0];
}

// A quarter of a tube, v from 0 at the foot to 1 at the height.
NurbsSurface quarter_tube(double radius, double height) {
  Eigen::Matrix3Xd net(3, 6);
  net << radius, radius, 0, radius, radius, 0, 0, radius, radius, 0, radius, radius, 0, 0, 0, height, height, height;
  const double w = std::sqrt(0.5);
  return {KnotVector(2, {0, 0, 0, 1, 1, 1}), KnotVector(1, {0, 0, 1, 1}), net, {1, w, 1, 1, w, 1}};
}

// All the way round the quarter tube from v0 to v1, the model curves up to another height.
iges::BoundaryCurves band(double radius, double height, double v0, double v1, double model_v1) {
  iges::BoundaryCurves out = rectangle(0, v0, 1, v1);
  const double w = std::sqrt(0.5), z0 = height * v0, z1 = height * model_v1;
  Eigen::Matrix3Xd foot(3, 3), top(3, 3), side(3, 2), other(3, 2);
  foot << radius, radius, 0, 0, radius, radius, z0, z0, z0;
  top << 0, radius, radius, radius, radius, 0, z1, z1, z1;
  side << 0, 0, radius, radius, z0, z1;
  other << radius, radius, 0, 0, z1, z0;
  const KnotVector arc(2, {0, 0, 0, 1, 1, 1}), line(1, {0, 0, 1, 1});
  out.model = {Curve3(arc, foot, {1, w, 1}), Curve3(line, side), Curve3(arc, top, {1, w, 1}), Curve3(line, other)};
  return out;
}

TEST(IgesLoops, ASurfaceGoesOnWhereBothKindsOfCurvesDo) {
  for (const double out : {1e-8, 1e-5, 1e-3, 0.02, 0.09}) {
    SCOPED_TRACE(out);
    const Result r = panels_of(quarter_tube(2, 3), {band(2, 3, 0.2, 1 + out, 1 + out)});
    ASSERT_EQ(r.panels.size(), 1u);
    expect_near_rel(r.area, pi / 2 * 2 * 3 * (0.8 + out), 1e-12);
    ASSERT_EQ(r.notes.size(), 1u);
    EXPECT_NE(r.notes[0].find("of the domain beyond the surface, which is continued"), std::string::npos) << r.notes[0];
    // The trim is the file's own.
    EXPECT_EQ(r.panels[0].loops[0].curves[1].curve.end(), Vector2d(1, 1 + out));
  }
}

TEST(IgesLoops, ASurfaceEndsWhereNoModelCurveGoesOn) {
  // Model curves that end with the surface outweigh parameter curves that don't.
  const Result held = panels_of(quarter_tube(2, 3), {band(2, 3, 0.2, 1.02, 1)});
  expect_near_rel(held.area, pi / 2 * 2 * 3 * 0.8, 1e-9);
  EXPECT_EQ(held.panels[0].surface, quarter_tube(2, 3));
  iges::BoundaryCurves parameter_only = band(2, 3, 0.2, 1.02, 1);
  parameter_only.model.clear();
  EXPECT_THROW(panels_of(quarter_tube(2, 3), {parameter_only}), GeometryError);
  // A thousandth needs no witness.
  iges::BoundaryCurves near = band(2, 3, 0.2, 1.001, 1);
  near.model.clear();
  expect_near_rel(panels_of(quarter_tube(2, 3), {near}).area, pi / 2 * 2 * 3 * 0.801, 1e-12);
}

// The upper half of a sphere, u from the pole to the equator, v the angle.
NurbsSurface half_sphere(double radius) {
  Eigen::Matrix3Xd net(3, 3);
  net << 0, radius, radius, 0, 0, 0, radius, radius, 0;
  const Curve3 meridian(KnotVector(2, {0, 0, 0, 1, 1, 1}), net, {1, std::sqrt(0.5), 1});
  return iges::revolved(meridian, Vector3d::Zero(), Vector3d::UnitZ(), {0, 2 * pi});
}

// Over the pole by half a turn, where a jump of the period's half says nothing about its direction.
TEST(IgesLoops, TheSideAtAPoleMayBeLeftOutOfALoop) {
  for (const double half : {3.141592653, 3.141592654})
    for (const double sense : {1.0, -1.0}) {
      SCOPED_TRACE(testing::Message() << half << ' ' << sense);
      iges::BoundaryCurves loop;
      loop.place = "here: ";
      const double a = sense > 0 ? 0 : 2 * pi, b = sense > 0 ? half : 2 * pi - half;
      for (const auto& [from, to] : std::vector<std::pair<Vector2d, Vector2d>>{
               {{1, a}, {1e-8, a}}, {{1e-8, b}, {1, b}}, {{1, b}, {1, (a + b) / 2}}, {{1, (a + b) / 2}, {1, a}}}) {
        Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 2);
        points.topRows<2>() << from, to;
        loop.parameter.emplace_back(KnotVector(1, {0, 0, 1, 1}), points);
      }
      const Result r = panels_of(half_sphere(2), {loop});
      ASSERT_EQ(r.panels.size(), 1u);
      expect_near_rel(r.area, pi * 2 * 2, 1e-8);
    }
}

// Two meridians and a parallel in space, from any of the three on and either way round: at the pole every angle is
// right.
TEST(IgesLoops, MeridiansMeetAtAPoleWhereverTheirLoopBegins) {
  const double radius = 2, lowest = 0.7;  // radians from the pole
  const auto meridian = [&](double angle) {
    const Curve2 arc = circular_arc({0, 0}, radius, pi / 2 - lowest, pi / 2);  // (from the axis, up)
    Eigen::Matrix3Xd points(3, arc.points().cols());
    points << arc.points().row(0) * std::cos(angle), arc.points().row(0) * std::sin(angle), arc.points().row(1);
    return Curve3(arc.knots(), points, arc.weights());
  };
  const auto parallel = [&](double from, double to) {
    const Curve2 arc = circular_arc({0, 0}, radius * std::sin(lowest), from, to);
    Eigen::Matrix3Xd points(3, arc.points().cols());
    points << arc.points(), Eigen::RowVectorXd::Constant(arc.points().cols(), radius * std::cos(lowest));
    return Curve3(arc.knots(), points, arc.weights());
  };
  for (const auto& [from, to] : std::vector<std::pair<double, double>>{
           {0.3, 1.9}, {0, pi / 2}, {1.9, 6.1}, {4, 6.2}, {5.9, 6.2}, {3, 4}, {0, 2}, {5, 2 * pi}})
    for (int begin = 0; begin < 3; ++begin)
      for (const bool backwards : {false, true}) {
        SCOPED_TRACE(testing::Message() << from << " to " << to << ", begins at " << begin << ' ' << backwards);
        iges::BoundaryCurves loop;
        loop.place = "here: ";
        loop.model = {parallel(from, to), meridian(to), reversed(meridian(from))};
        std::rotate(loop.model.begin(), loop.model.begin() + begin, loop.model.end());
        if (backwards) {
          std::ranges::reverse(loop.model);
          for (Curve3& c : loop.model) c = reversed(c);
        }
        const Result r = panels_of(half_sphere(radius), {loop});
        ASSERT_EQ(r.panels.size(), 1u);
        expect_near_rel(r.area, (to - from) * radius * radius * (1 - std::cos(lowest)), 1e-7);
      }
}

// A tube by its two circles, of two halves each, and the seam there and back: both ways round the halves of the first
// circle meet, to rounding.
TEST(IgesLoops, RoundingDoesntTurnTheHalvesOfACircle) {
  const double radius = 2, height = 3;
  const auto line = [](const Vector3d& a, const Vector3d& b) {
    Eigen::Matrix3Xd points(3, 2);
    points << a, b;
    return Curve3(KnotVector(1, {0, 0, 1, 1}), points);
  };
  const Vector3d low(radius, 0, 0), high(radius, 0, height);
  const auto half = [&](double from, double to, double z, const Vector3d& move_end) {
    const Curve2 arc = circular_arc({0, 0}, radius, from, to);
    Eigen::Matrix3Xd points(3, arc.points().cols());
    points << arc.points(), Eigen::RowVectorXd::Constant(arc.points().cols(), z);
    points.col(0) = from == 0 ? (z == 0 ? low : high) : Vector3d(-radius, 0, z);
    points.rightCols<1>() = (to == pi ? Vector3d(-radius, 0, z) : (z == 0 ? low : high)) + move_end;
    return Curve3(arc.knots(), points, arc.weights());
  };
  for (const double rounding : {0.0, 1e-15}) {
    const Vector3d move(0, rounding, 0), none(0, 0, 0);
    iges::BoundaryCurves loop;
    loop.place = "here: ";
    loop.model = {half(0, pi, 0, move),
                  half(pi, 2 * pi, 0, none),
                  line(low, high),
                  reversed(half(pi, 2 * pi, height, none)),
                  reversed(half(0, pi, height, none)),
                  line(high, low)};
    const Result r =
        panels_of(iges::revolved(line(low, high), Vector3d::Zero(), Vector3d::UnitZ(), {0, 2 * pi}), {loop});
    ASSERT_EQ(r.panels.size(), 1u) << rounding;
    expect_near_rel(r.area, 2 * pi * radius * height, 1e-9);
  }
}

TEST(IgesLoops, ANarrowGapIsClosedByAStraightPieceAndSaid) {
  for (const double gap : {2e-3, 9e-3}) {
    SCOPED_TRACE(gap);
    iges::BoundaryCurves loop = rectangle(0.2, 0.2, 0.8, 0.6);
    Eigen::Matrix3Xd side = loop.parameter[1].points();
    side(1, 1) -= gap;  // ends below its corner
    loop.parameter[1] = Curve3(loop.parameter[1].knots(), side);
    const Result r = panels_of(plane(), {loop});
    expect_near_rel(r.area, 0.6 * 0.4, 1e-13);
    EXPECT_EQ(r.panels[0].loops[0].curves.size(), 5u);
    EXPECT_TRUE(std::ranges::any_of(r.notes, [](const std::string& n) {
      return n.find("after curve 1 is closed by a straight piece") != std::string::npos;
    }));
  }
  iges::BoundaryCurves open = rectangle(0.2, 0.2, 0.8, 0.6);
  open.parameter.pop_back();
  EXPECT_THROW(panels_of(plane(), {open}), GeometryError);
}

// One model curve with corners all around the face, and no parameter curves.
TEST(IgesLoops, AModelCurveMayTurnCorners) {
  const auto on_tube = [](double u, double z) { return Vector3d(quarter_tube(2, 3)(u, z / 3)); };
  // Along straight sides up, and along the arcs by cubics through them, all in one spline of degree 3.
  std::vector<Vector3d> points{on_tube(0.1, 0.5)};
  std::vector<double> knots{0, 0, 0, 0};
  const auto add = [&](const Vector3d& a, const Vector3d& b, const Vector3d& end) {
    for (const Vector3d& x : {a, b, end}) points.push_back(x);
    for (int k = 0; k < 3; ++k) knots.push_back(static_cast<double>(points.size()));
  };
  const auto line = [&](double u0, double z0, double u1, double z1) {
    const Vector3d a = on_tube(u0, z0), b = on_tube(u1, z1);
    add(a + (b - a) / 3, a + (b - a) * 2 / 3, b);
  };
  line(0.1, 0.5, 0.1, 2.5);
  const auto arc = [&](double u0, double u1, double z) {
    for (int k = 0; k < 8; ++k) {
      const double s = u0 + (u1 - u0) * k / 8, e = u0 + (u1 - u0) * (k + 1) / 8, h = (e - s) / 3;
      const SurfaceJet a = evaluate(quarter_tube(2, 3), s, z / 3), b = evaluate(quarter_tube(2, 3), e, z / 3);
      add(a.x + h * a.u, b.x - h * b.u, b.x);
    }
  };
  arc(0.1, 0.9, 2.5);
  line(0.9, 2.5, 0.9, 0.5);
  arc(0.9, 0.1, 0.5);
  knots.push_back(knots.back());
  Eigen::Matrix3Xd net(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k) net.col(static_cast<Eigen::Index>(k)) = points[k];
  iges::BoundaryCurves loop;
  loop.place = "here: ";
  loop.model = {Curve3(KnotVector(3, knots), net)};
  const Result r = panels_of(quarter_tube(2, 3), {loop});
  const auto angle = [&](double u) { return std::atan2(on_tube(u, 0).y(), on_tube(u, 0).x()); };
  expect_near_rel(r.area, 2 * (angle(0.9) - angle(0.1)) * 2, 1e-5);
  for (const TrimCurve& c : r.panels[0].loops[0].curves) EXPECT_EQ(c.index, 0);
}

TEST(IgesLoops, OuterLoopsThatOverlapAreRefusedWithThePlace) {
  try {
    panels_of(plane(), {rectangle(0, 0, 0.5, 0.5), rectangle(0.25, 0.25, 1, 1)}, false);
    FAIL();
  } catch (const GeometryError& e) {
    EXPECT_NE(std::string(e.what()).find("here: loops 0 and 1 overlap"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("(u, v) = ("), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace toile
