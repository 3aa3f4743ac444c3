// SPDX-License-Identifier: GPL-3.0-or-later
// Loops that meet each other or the seam of a closed surface, from boundaries to panels.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/error.h"
#include "io/iges/face.h"
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
