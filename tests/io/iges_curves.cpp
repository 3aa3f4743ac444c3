// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "geometry/error.h"
#include "io/iges_corpus.h"
#include "support/near.h"

namespace toile {
namespace {

using test::message_of;
using test::read_corpus;

template <class Equation>
void expect_on(const Curve2& curve, Equation&& equation) {
  for (int i = 0; i <= 40; ++i) {
    const double t = curve.domain().min + curve.domain().length() * i / 40;
    const Eigen::Vector2d p = curve(t);
    EXPECT_NEAR(equation(p.x(), p.y()), 0, 1e-14) << t;
  }
}

const TrimmedSurface& panel() {
  static const PanelFile file = read_corpus("conics_and_splines");
  return file.panels[0];
}

TEST(IgesCurves, AParabolaAndAHyperbolaLieOnTheirEquations) {
  const Curve2& parabola = panel().loops[0].curves[1].curve;
  EXPECT_FALSE(parabola.rational());
  expect_on(parabola, [](double x, double y) { return x - 0.8 - 0.5 * (y - 0.1) * (0.9 - y); });
  const Curve2& hyperbola = panel().loops[0].curves[3].curve;
  EXPECT_TRUE(hyperbola.rational());
  expect_on(hyperbola, [](double x, double y) {
    return 0.0081 * ((x - 0.05) * (x - 0.05) / 0.0081 - (y - 0.5) * (y - 0.5) / 0.09 - 1);
  });
  EXPECT_NEAR(hyperbola(0.5).x(), 0.14, 1e-15);  // the apex, on the branch of its ends
  EXPECT_EQ(hyperbola.start(), Eigen::Vector2d(0.2, 0.9));
  EXPECT_EQ(hyperbola.end(), Eigen::Vector2d(0.2, 0.1));
}

TEST(IgesCurves, ATurnedEllipseIsWholeAndCounterClockwise) {
  const Curve2& ellipse = panel().loops[1].curves[0].curve;
  const double c = std::sqrt(0.75), s = 0.5;
  expect_on(ellipse, [&](double x, double y) {
    const double a = (c * (x - 0.5) + s * (y - 0.35)) / 0.1, b = (c * (y - 0.35) - s * (x - 0.5)) / 0.05;
    return 0.01 * (a * a + b * b - 1);
  });
  EXPECT_EQ(ellipse.start(), ellipse.end());
  const Eigen::Vector2d quarter = ellipse(ellipse.domain().min + ellipse.domain().length() / 4);
  EXPECT_LE((quarter - Eigen::Vector2d(0.5 - 0.05 * s, 0.35 + 0.05 * c)).norm(), 1e-15);
}

TEST(IgesCurves, AParametricSplineIsItsPolynomials) {
  const Curve2& spline = panel().loops[0].curves[2].curve;
  EXPECT_EQ(spline.degree(), 2);  // no cubic term is there
  EXPECT_EQ(spline.domain().max, 2);
  for (double s : {0.0, 0.25, 0.7}) {
    EXPECT_LE((spline(s) - Eigen::Vector2d(0.8 - 0.3 * s, 0.9 - 0.05 * s * s)).norm(), 1e-15);
    EXPECT_LE((spline(1 + s) - Eigen::Vector2d(0.5 - 0.3 * s, 0.85 - 0.1 * s + 0.15 * s * s)).norm(), 1e-15);
  }
}

TEST(IgesCurves, PolylinesDropRepeatedPointsAndForm63Closes) {
  EXPECT_EQ(panel().loops[0].curves[0].curve.points().cols(), 3);
  const Curve2& square = panel().loops[2].curves[0].curve;
  EXPECT_EQ(square.points().cols(), 5);  // one point of the file stands twice, one is added
  EXPECT_EQ(square.start(), square.end());
}

TEST(IgesCurves, ConicsWhoseEndsDontFitAreRefusedWithTheirPlace) {
  EXPECT_NE(message_of<InputError>([] {
              read_corpus("broken/conic_off_its_curve");
            }).find("conic_off_its_curve.igs:20: entity 104: an end of the conic, (0.9, 0.), does not lie on it"),
            std::string::npos);
  EXPECT_NE(message_of<InputError>([] { read_corpus("broken/two_branches"); }).find("no common branch"),
            std::string::npos);
  EXPECT_NE(message_of<InputError>([] { read_corpus("broken/huge_spline"); }).find("1000000000 segments"),
            std::string::npos);
}

}  // namespace
}  // namespace toile
