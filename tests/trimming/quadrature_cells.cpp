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

}  // namespace
}  // namespace toile::test
