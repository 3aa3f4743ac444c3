// SPDX-License-Identifier: GPL-3.0-or-later
// Quadrature on cut cells made by hand, against exact moments.
#include <chrono>
#include <cmath>
#include <numbers>

#include "hand_made.h"

namespace toile::test {
namespace {

void expect_exact_polygon(const std::vector<Vector2d>& corners, const CutQuadrature& rule, int degree,
                          double tolerance = 1e-12) {
  for (int b = 0; b <= 2 * degree; ++b)
    for (int a = 0; a <= 2 * degree; ++a)
      EXPECT_TRUE(near_rel(moment(rule, a, b), exact_moment(corners, a, b).convert_to<double>(), tolerance))
          << "u^" << a << " v^" << b;
}

// Left of every edge.
bool in_convex(const std::vector<Vector2d>& corners, double u, double v) {
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vector2d p = corners[k], d = corners[(k + 1) % corners.size()] - p;
    if (d.x() * (v - p.y()) - d.y() * (u - p.x()) < 0) return false;
  }
  return true;
}

TEST(CutQuadrature, ConvexPolygonsAreExactToTwiceTheDegree) {
  const std::vector<std::vector<Vector2d>> polygons = {
      {{0, 0}, {1, 0}, {0, 1}},                                         // half
      {{0, 0}, {0.25, 0}, {0, 0.375}},                                  // corner
      {{0.25, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0.125}},                  // all but a corner
      {{0, 0}, {0.625, 0}, {0.375, 1}, {0, 1}},                         // upright cut
      {{0, 0}, {1, 0}, {1, 0.625}, {0, 0.25}},                          // level cut
      {{0.25, 0}, {0.75, 0}, {1, 0.5}, {0.75, 1}, {0.25, 1}, {0, 0.5}}  // two corners
  };
  for (int degree = 1; degree <= 4; ++degree)
    for (const auto& corners : polygons) {
      const CutQuadrature rule = rule_of(cut_cell(degree, {polygon(corners)}));
      expect_lawful(rule, degree, [&](double u, double v) { return in_convex(corners, u, v); });
      expect_exact_polygon(corners, rule, degree);
    }
}

TEST(CutQuadrature, NonConvexPolygonIsExact) {
  const std::vector<Vector2d> comb = {{0, 0},      {1, 0},      {1, 1},     {0.75, 1}, {0.75, 0.25},
                                      {0.5, 0.25}, {0.5, 0.75}, {0.375, 1}, {0, 1}};
  for (int degree = 2; degree <= 3; ++degree) {
    const CutQuadrature rule = rule_of(cut_cell(degree, {polygon(comb)}));
    expect_lawful(rule, degree, [](double u, double v) {
      return u <= 0.375 || v <= 0.25 || u >= 0.75 || (u <= 0.5 && (v <= 0.75 || (u - 0.375) * 2 <= 1 - v));
    });
    expect_exact_polygon(comb, rule, degree);
  }
}

// Under v = u^2 the moment of u^a v^b is 1 / ((b + 1) (a + 2 b + 3)).
TEST(CutQuadrature, ParabolaIsExact) {
  const Curve2 parabola = bezier({{0, 0}, {0.5, 0}, {1, 1}});
  for (int degree = 1; degree <= 4; ++degree) {
    const CutQuadrature rule =
        rule_of(cut_cell(degree, {{border({0, 0}, {1, 0}), border({1, 0}, {1, 1}), trim(parabola, 1, 0)}}));
    expect_lawful(rule, degree, [](double u, double v) { return v <= u * u && v >= 0 && u <= 1; });
    for (int b = 0; b <= 2 * degree; ++b)
      for (int a = 0; a <= 2 * degree; ++a)
        expect_near_rel(moment(rule, a, b), 1.0 / ((b + 1) * (a + 2 * b + 3)), 1e-12);
  }
}

// Inside u^2 + v^2 <= r^2, u, v >= 0: r^(a+b+2) / (a+b+2) * B((a+1)/2, (b+1)/2) / 2.
TEST(CutQuadrature, QuarterDiscIsExactToRounding) {
  for (const double r : {1.0, 0.7, 1e-3})
    for (int degree = 1; degree <= 4; ++degree) {
      Side arc = trim(circular_arc({0, 0}, r, 0, std::numbers::pi / 2));
      arc.from = {r, 0};
      arc.to = {0, r};
      const CutQuadrature rule = rule_of(cut_cell(degree, {{border({0, 0}, {r, 0}), arc, border({0, r}, {0, 0})}}));
      expect_lawful(rule, degree, [&](double u, double v) { return u > 0 && v > 0 && std::hypot(u, v) < r; });
      for (int b = 0; b <= 2 * degree; ++b)
        for (int a = 0; a <= 2 * degree; ++a)
          expect_near_rel(moment(rule, a, b),
                          std::pow(r, a + b + 2) / (a + b + 2) * std::beta((a + 1) / 2.0, (b + 1) / 2.0) / 2, 1e-12);
    }
}

// Material between v = 0.5 and a line eps above it, and the same upright.
TEST(CutQuadrature, ThinSliversAreExactRelativeToThemselves) {
  for (double eps = 1e-3; eps > 5e-13; eps /= 10)
    for (const bool upright : {false, true}) {
      std::vector<Vector2d> corners = {{0, 0.5}, {1, 0.5}, {1, 0.5 + eps}, {0, 0.5 + 0.5 * eps}};
      if (upright) {
        for (Vector2d& p : corners) p = {p.y(), p.x()};
        std::reverse(corners.begin(), corners.end());
      }
      const CutQuadrature rule = rule_of(cut_cell(2, {polygon(corners)}));
      expect_lawful(rule, 2, [&](double u, double v) { return in_convex(corners, u, v); });
      expect_near_rel(rule.area, exact_moment(corners, 0, 0).convert_to<double>(), 1e-12);
      expect_exact_polygon(corners, rule, 2);
    }
}

// Corner cuts a x b with either leg down to 1e-10: moments about the cut's own corner, relative to themselves.
TEST(CutQuadrature, CornerSliversAreExactRelativeToThemselves) {
  for (const double a : {1.0, 0.3, 1e-3, 1e-6, 1e-10})
    for (const double b : {1.0, 0.3, 1e-3, 1e-6, 1e-10})
      for (const Vector2d& corner : {Vector2d(0, 0), Vector2d(1, 1)}) {
        const double s = corner.x() > 0 ? -1 : 1;
        const std::vector<Vector2d> corners = {corner, corner + Vector2d(s * a, 0), corner + Vector2d(0, s * b)};
        const CutQuadrature rule = rule_of(cut_cell(2, {polygon(corners)}));
        expect_lawful(rule, 2, [&](double u, double v) { return in_convex(corners, u, v); });
        // The area of the sliver that the rounded corners span.
        expect_near_rel(rule.area, exact_moment(corners, 0, 0).convert_to<double>(), 1e-12);
        if (s < 0) continue;  // the points themselves are rounded to 1e-16 there
        for (int j = 0; j <= 4; ++j)
          for (int i = 0; i <= 4; ++i)
            expect_near_rel(moment(rule, i, j), exact_moment(corners, i, j).convert_to<double>(), 1e-12);
      }
}

// What is left of a cell when the sliver is taken away.
TEST(CutQuadrature, CellsWithoutASliverAreExact) {
  for (double eps = 1e-3; eps > 5e-13; eps /= 10) {
    const std::vector<std::vector<Vector2d>> polygons = {
        {{0, 0}, {1, 0}, {1, 1 - eps}, {0, 1}},
        {{eps, 0}, {1, 0}, {1, 1}, {0, 1}, {0, eps}},
        {{0.5, 0}, {1, 0}, {1, 1}, {0, 1}, {0, eps}},
        {{eps, 0}, {1, 0}, {1, 1 - eps}, {1 - eps, 1}, {0, 1}, {0, eps}}};
    for (const auto& corners : polygons) {
      const CutQuadrature rule = rule_of(cut_cell(2, {polygon(corners)}));
      expect_lawful(rule, 2, [&](double u, double v) { return in_convex(corners, u, v); });
      expect_exact_polygon(corners, rule, 2);
    }
  }
}

// A strip of width eps across the cell, slanted: its box is the whole cell, and its area a difference of numbers near 1
// in extended precision.
TEST(CutQuadrature, SlantedSliversAreExact) {
  for (double eps = 1e-2; eps > 5e-13; eps /= 10) {
    const std::vector<Vector2d> corners = {{0, 0}, {eps, 0}, {1, 0.75}, {1, 0.75 + eps}};
    const CutQuadrature rule = rule_of(cut_cell(2, {polygon(corners)}));
    expect_lawful(
        rule, 2, [&](double u, double v) { return in_convex(corners, u, v); }, std::max(1e-13, 3e-20 / eps));
    expect_near_rel(rule.area, exact_moment(corners, 0, 0).convert_to<double>(), std::max(1e-12, 1e-18 / eps));
    expect_exact_polygon(corners, rule, 2, std::max(1e-12, 1e-16 / eps));
  }
}

// The lens that a parabola cuts off just above v = 0: 0 <= v <= 4 h u (1 - u).
TEST(CutQuadrature, GrazingParabolaIsExact) {
  for (double h = 0.25; h > 5e-13; h /= 10) {
    const Curve2 arch = bezier({{0, 0}, {0.5, 2 * h}, {1, 0}});
    const CutQuadrature rule = rule_of(cut_cell(2, {{border({0, 0}, {1, 0}), trim(arch, 1, 0)}}));
    expect_lawful(rule, 2, [&](double u, double v) { return v > 0 && v < 4 * h * u * (1 - u); });
    // Integral of u^a (4 h u (1 - u))^(b+1) / (b+1).
    for (int b = 0; b <= 4; ++b)
      for (int a = 0; a <= 4; ++a)
        expect_near_rel(moment(rule, a, b), power(4 * h, b + 1) / (b + 1) * std::beta(a + b + 2.0, b + 2.0), 1e-12);
  }
}

TEST(CutQuadrature, HolesInOneCell) {
  const std::vector<Vector2d> square = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  std::vector<std::vector<Side>> loops = {
      {border({0, 0}, {1, 0}), border({1, 0}, {1, 1}), border({1, 1}, {0, 1}), border({0, 1}, {0, 0})}};
  const std::vector<std::pair<Vector2d, double>> holes = {{{0.25, 0.3}, 0.2}, {{0.7, 0.7}, 0.25}, {{0.8, 0.1}, 1e-4}};
  double area = 1;
  for (const auto& [centre, r] : holes) {
    const Curve2 circle = circular_arc(centre, r, 0, 2 * std::numbers::pi);
    Side side = trim(circle, circle.domain().max, circle.domain().min);
    side.to = side.from;
    loops.push_back({side});
    area -= std::numbers::pi * r * r;
    for (int degree = 1; degree <= 3; ++degree) {
      const CutQuadrature rule = rule_of(cut_cell(degree, loops));
      expect_lawful(rule, degree, [&](double u, double v) {
        for (std::size_t k = 0; k + 1 < loops.size(); ++k)
          if ((Vector2d(u, v) - holes[k].first).norm() <= holes[k].second) return false;
        return u > 0 && v > 0 && u < 1 && v < 1;
      });
      expect_near_rel(rule.area, area, 1e-13);
      // Any circle's share of u^2: pi r^2 (x^2 + r^2 / 4).
      double second = 1.0 / 3;
      for (std::size_t k = 0; k + 1 < loops.size(); ++k) {
        const auto& [c, radius] = holes[k];
        second -= std::numbers::pi * radius * radius * (c.x() * c.x() + radius * radius / 4);
      }
      expect_near_rel(moment(rule, 2, 0), second, 1e-12);
    }
  }
}

// A whole disc inside one cell, its arcs of any number.
TEST(CutQuadrature, DiscInOneCell) {
  for (const int arcs : {1, 2, 3, 7})
    for (const double r : {0.5, 0.123, 1e-3, 1e-8}) {
      std::vector<Side> loop;
      for (int k = 0; k < arcs; ++k)
        loop.push_back(
            trim(circular_arc({0.5, 0.5}, r, 2 * std::numbers::pi * k / arcs, 2 * std::numbers::pi * (k + 1) / arcs)));
      const CutQuadrature rule = rule_of(cut_cell(2, {loop}));
      expect_lawful(rule, 2, [&](double u, double v) { return std::hypot(u - 0.5, v - 0.5) < r; });
      expect_near_rel(rule.area, std::numbers::pi * r * r, r > 1e-6 ? 1e-12 : 1e-7);
    }
}

// Turning or mirroring the cell turns the moments; running the curves the other way changes nothing.
TEST(CutQuadrature, TurnedAndMirroredCellsAgree) {
  const std::vector<Vector2d> cubic = {{0.2, 0}, {0.9, 0.3}, {0.1, 0.6}, {0.7, 1}};
  const auto moments = [](const CutQuadrature& rule) {
    std::vector<double> m;
    for (int b = 0; b <= 4; ++b)
      for (int a = 0; a <= 4; ++a) m.push_back(moment(rule, a, b));
    return m;
  };
  const auto made = [&](const std::function<Vector2d(Vector2d)>& map, bool mirrored, bool backwards) {
    std::vector<Vector2d> control;
    for (const Vector2d& p : cubic) control.push_back(map(p));
    if (backwards) std::reverse(control.begin(), control.end());
    const Curve2 curve = bezier(control);
    const Vector2d a = map({0, 0}), b = map({0.2, 0}), c = map({0.7, 1}), d = map({0, 1});
    const double start = backwards ? 1 : 0;
    std::vector<Side> loop = {border(a, b), trim(curve, start, 1 - start), border(c, d), border(d, a)};
    if (mirrored) loop = {border(b, a), border(a, d), border(d, c), trim(curve, 1 - start, start)};
    return rule_of(cut_cell(2, {loop}));
  };
  const auto plain = moments(made([](Vector2d p) { return p; }, false, false));
  EXPECT_GT(plain[0], 0.4);
  const auto backwards = moments(made([](Vector2d p) { return p; }, false, true));
  const auto mirrored = moments(made([](Vector2d p) { return Vector2d(p.y(), p.x()); }, true, false));
  const auto turned = made([](Vector2d p) { return Vector2d(1 - p.y(), p.x()); }, false, false);
  for (int b = 0; b <= 4; ++b)
    for (int a = 0; a <= 4; ++a) {
      expect_near_rel(backwards[a + 5 * b], plain[a + 5 * b], 1e-13);
      expect_near_rel(mirrored[b + 5 * a], plain[a + 5 * b], 1e-13);
      expect_near_rel(sum(turned, [&](double u, double v) { return power(v, a) * power(1 - u, b); }), plain[a + 5 * b],
                      1e-13);
    }
}

TEST(CutQuadrature, SameInputSameBytes) {
  const HandMade cell =
      cut_cell(3, {{border({0, 0}, {1, 0}), border({1, 0}, {1, 1}), trim(bezier({{0, 0}, {0.5, 0}, {1, 1}}), 1, 0)}});
  const CutQuadrature a = rule_of(cell), b = rule_of(cell);
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.weights, b.weights);
}

// Curves of several knot spans, rational with uneven weights, cut at parameters inside the spans.
TEST(CutQuadrature, PartsOfSplinesAgreeWithTheirWhole) {
  Curve2::Points p(2, 6);
  p << 0, 0.2, 0.35, 0.6, 0.8, 1,  //
      0.3, 0.8, 0.1, 0.9, 0.2, 0.6;
  const Curve2 spline(KnotVector(3, {0, 0, 0, 0, 0.3, 0.7, 1, 1, 1, 1}), p, {1, 3, 0.5, 2, 1, 0.25});
  const auto below = [&](std::vector<double> cuts) {
    std::vector<Side> loop = {border({0, 0}, {1, 0}), border({1, 0}, {1, 0.6})};
    for (std::size_t k = cuts.size() - 1; k > 0; --k) loop.push_back(trim(spline, cuts[k], cuts[k - 1]));
    loop.push_back(border({0, 0.3}, {0, 0}));
    return rule_of(cut_cell(2, {loop}));
  };
  const CutQuadrature whole = below({0, 1}), parts = below({0, 0.1, 0.3, 0.45, 0.5, 0.99, 1});
  EXPECT_GT(whole.area, 0.3);
  for (int b = 0; b <= 4; ++b)
    for (int a = 0; a <= 4; ++a) expect_near_rel(moment(whole, a, b), moment(parts, a, b), 1e-12);
}

// A quarter of a circle with weights 1, s, s^2 is the same curve for any s, at other parameters.
TEST(CutQuadrature, WeightsOfOneCurveMayDifferByAnyFactor) {
  const double h = std::sqrt(0.5);
  for (const double s : {1e-10, 1e-5, 1e5, 1e10}) {
    SCOPED_TRACE(s);
    const Side arc = trim(bezier({{1, 0}, {1, 1}, {0, 1}}, {1, h * s, s * s}));
    const CutQuadrature rule = rule_of(cut_cell(2, {{border({0, 0}, {1, 0}), arc, border({0, 1}, {0, 0})}}));
    for (int b = 0; b <= 4; ++b)
      for (int a = 0; a <= 4; ++a)
        expect_near_rel(moment(rule, a, b), std::beta((a + 1) / 2.0, (b + 1) / 2.0) / (a + b + 2) / 2, 1e-12);
  }
}

// Under the conic (1, 0), (1, 1), (0, 1) of weights 1, h, 1: with x and y from (1, 1) the corner above it is x + y + 2
// h sqrt(x y) < 1, whose area is -I'(h) / 4 with I = integral of 1 / (1 + h sin f) over half a turn.
TEST(CutQuadrature, ConicsOfAnyWeightHaveTheirArea) {
  for (const double h : {2.0, 100.0, 1e6, 1e10, 1e14}) {
    SCOPED_TRACE(h);
    const Side arc = trim(bezier({{1, 0}, {1, 1}, {0, 1}}, {1, h, 1}));
    const CutQuadrature rule = rule_of(cut_cell(2, {{border({0, 0}, {1, 0}), arc, border({0, 1}, {0, 0})}}));
    const double corner = (h * std::acosh(h) / std::sqrt(h * h - 1) - 1) / (h * h - 1) / 2;
    expect_near_rel(rule.area, 1 - corner, 1e-12);
  }
  for (const double h : {1e-6, 1e-14}) {
    SCOPED_TRACE(h);
    const Side arc = trim(bezier({{1, 0}, {1, 1}, {0, 1}}, {1, h, 1}));
    const CutQuadrature rule = rule_of(cut_cell(2, {{border({0, 0}, {1, 0}), arc, border({0, 1}, {0, 0})}}));
    const double corner = (1 - h * std::acos(h) / std::sqrt(1 - h * h)) / (1 - h * h) / 2;
    expect_near_rel(rule.area, 1 - corner, 1e-12);
  }
}

TEST(CutQuadrature, UncutCellsCarryGaussPoints) {
  TrimmedSurface surface;
  surface.surface = flat_cell({0, 2}, {0, 3}, 2);
  TrimTopology topology;
  topology.mesh = {{0, 2}, {0, 3}};
  topology.cells = {CellKind::inside};
  const CutQuadrature rule =
      quadrature(surface, topology, {.degree_u = {}, .degree_v = {}, .gauss_u = {}, .gauss_v = 2});
  ASSERT_EQ(rule.points.size(), 6u);
  EXPECT_TRUE(rule.cells[0].tensor);
  EXPECT_EQ(rule.cells[0].cut_fraction, 1);
  EXPECT_LT(rule.points[0].x(), rule.points[1].x());
  EXPECT_EQ(rule.points[0].y(), rule.points[2].y());
  expect_near_rel(moment(rule, 5, 3), 64.0 / 6 * 81 / 4, 1e-14);
}

// A quarter of a cylinder of radius 2 and height 3, rational: area and lengths are those of the flat sheet it rolls up.
TEST(PanelMeasure, TrimmedCylinder) {
  const double h = std::sqrt(0.5);
  Eigen::Matrix3Xd net(3, 6);
  net << 2, 2, 0, 2, 2, 0,  //
      0, 2, 2, 0, 2, 2,     //
      0, 0, 0, 3, 3, 3;
  HandMade made = cut_cell(2, {{border({0, 0}, {1, 0}), border({1, 0}, {1, 1}), trim({1, 1}, {0, 0})}});
  made.surface.surface = NurbsSurface(uniform_knots(2, 1), uniform_knots(1, 1), net, {1, h, 1, 1, h, 1});
  // The angle is symmetric about u = 1/2, so the part below v = u is half of the sheet by symmetry.
  const PanelMeasure cut = measure(made.surface, made.topology);
  expect_near_rel(cut.area, std::numbers::pi * 3 / 2, 1e-10);
  made.topology.cells = {CellKind::inside};
  made.topology.cut_cells.clear();
  made.surface.loops = {natural_loop(made.surface.surface)};
  const PanelMeasure whole = measure(made.surface, made.topology);
  expect_near_rel(whole.area, std::numbers::pi * 3, 1e-10);
  ASSERT_EQ(whole.loop_lengths.size(), 1u);
  expect_near_rel(whole.loop_lengths[0], 2 * std::numbers::pi + 6, 1e-10);
}

// A disc trim on a hyperbolic paraboloid z = u v / 2: area is 2 pi times the integral of r sqrt(1 + r^2 / 4).
TEST(PanelMeasure, DiscOnASaddle) {
  const double r = 0.75;
  HandMade made = cut_cell({-1, 1}, {-1, 1}, 1, {{trim(circular_arc({0, 0}, r, 0, 2 * std::numbers::pi))}});
  Eigen::Matrix3Xd net = made.surface.surface.points();
  for (int k = 0; k < net.cols(); ++k) net(2, k) = net(0, k) * net(1, k) / 2;
  made.surface.surface = made.surface.surface.with_points(net);
  const PanelMeasure saddle = measure(made.surface, made.topology);
  expect_near_rel(saddle.area, 2 * std::numbers::pi * 4 / 3 * (std::pow(1 + r * r / 4, 1.5) - 1), 1e-10);
  // z' = r^2 cos(2 a) / 2 around the circle.
  double length = 0;
  for (int k = 0; k < 4096; ++k) length += std::hypot(r, r * r / 2 * std::cos(4 * std::numbers::pi * k / 4096));
  expect_near_rel(saddle.loop_lengths[0], length * 2 * std::numbers::pi / 4096, 1e-10);
}

}  // namespace
}  // namespace toile::test
