// SPDX-License-Identifier: GPL-3.0-or-later
// Cut cells made by hand: a surface of one knot span (or a few) over a rectangle, its trims and their topology as a
// tracer would give them.
#pragma once

#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <functional>
#include <optional>
#include <vector>

#include "geometry/trimmed_surface.h"
#include "support/near.h"
#include "trimming/quadrature.h"
#include "trimming/topology.h"

namespace toile::test {

using Eigen::Vector2d;
using Rational = boost::multiprecision::cpp_rational;

// One side of a cell's material, in the direction that has the material on its left.
struct Side {
  std::optional<Curve2> curve;  // none: a straight piece of the cell's border
  double t0 = 0, t1 = 0;
  Vector2d from{0, 0}, to{0, 0};
};
inline Side border(Vector2d from, Vector2d to) {
  return {{}, 0, 0, from, to};
}
inline Side trim(const Curve2& curve, double t0, double t1) {
  return {curve, t0, t1, curve(t0), curve(t1)};
}
inline Side trim(const Curve2& curve) {
  return trim(curve, curve.domain().min, curve.domain().max);
}
inline Side trim(Vector2d from, Vector2d to) {
  Side side = trim(line_segment<2>(from, to));
  side.from = from;
  side.to = to;
  return side;
}
inline std::vector<Side> polygon(const std::vector<Vector2d>& corners) {
  std::vector<Side> sides;
  for (std::size_t k = 0; k < corners.size(); ++k) sides.push_back(trim(corners[k], corners[(k + 1) % corners.size()]));
  return sides;
}

inline Curve2 bezier(const std::vector<Vector2d>& points, std::vector<double> weights = {}) {
  Curve2::Points p(2, points.size());
  for (std::size_t k = 0; k < points.size(); ++k) p.col(k) = points[k];
  return Curve2(uniform_knots(static_cast<int>(points.size()) - 1, 1), p, std::move(weights));
}

// The identity map (u, v, 0) at a degree on one span over the rectangle.
inline NurbsSurface flat_cell(Interval u, Interval v, int degree) {
  const KnotVector ku = uniform_knots(degree, 1, u), kv = uniform_knots(degree, 1, v);
  Eigen::Matrix3Xd net(3, (degree + 1) * (degree + 1));
  for (int j = 0; j <= degree; ++j)
    for (int i = 0; i <= degree; ++i) net.col(i + (degree + 1) * j) << ku.greville(i), kv.greville(j), 0;
  return {ku, kv, net};
}

struct HandMade {
  TrimmedSurface surface;
  TrimTopology topology;
};

// One cut cell. Loops of the surface hold the curves as given; pieces refer to them.
inline HandMade cut_cell(Interval u, Interval v, int degree, const std::vector<std::vector<Side>>& loops) {
  HandMade made;
  made.surface.surface = flat_cell(u, v, degree);
  made.topology.mesh = {{u.min, u.max}, {v.min, v.max}};
  made.topology.cells = {CellKind::cut};
  made.topology.vertices.assign(4, VertexKind::outside);
  CutCell cell;
  for (const auto& loop : loops) {
    TrimLoop curves;
    curves.kind = made.surface.loops.empty() ? LoopKind::outer : LoopKind::hole;
    curves.index = static_cast<int>(made.surface.loops.size());
    std::vector<BoundaryPiece> pieces;
    for (const Side& side : loop) {
      BoundaryPiece piece{.loop = -1, .curve = -1, .t0 = side.t0, .t1 = side.t1, .from = side.from, .to = side.to};
      if (side.curve) {
        piece.loop = curves.index;
        piece.curve = static_cast<int>(curves.curves.size());
        curves.curves.push_back({*side.curve, piece.curve, side.t0 > side.t1, {}});
      }
      pieces.push_back(piece);
    }
    for (std::size_t k = 0; k < pieces.size(); ++k) pieces[(k + 1) % pieces.size()].from = pieces[k].to;
    made.surface.loops.push_back(curves);
    cell.loops.push_back(pieces);
  }
  made.topology.cut_cells = {cell};
  return made;
}
inline HandMade cut_cell(int degree, const std::vector<std::vector<Side>>& loops) {
  return cut_cell({0, 1}, {0, 1}, degree, loops);
}

inline CutQuadrature rule_of(const HandMade& made) {
  return quadrature(made.surface, made.topology);
}

inline double sum(const CutQuadrature& rule, const std::function<double(double, double)>& f) {
  double total = 0;
  for (std::size_t k = 0; k < rule.points.size(); ++k)
    total += rule.weights[k] * f(rule.points[k].x(), rule.points[k].y());
  return total;
}
inline double power(double x, int n) {
  double y = 1;
  for (int k = 0; k < n; ++k) y *= x;
  return y;
}
inline double moment(const CutQuadrature& rule, int a, int b) {
  return sum(rule, [&](double u, double v) { return power(u, a) * power(v, b); });
}

// Integral of (u - u0)^a (v - v0)^b over a polygon in exact arithmetic: Green's theorem edge by edge, the edge's
// polynomial expanded by the binomial theorem.
inline Rational exact_moment(const std::vector<Vector2d>& corners, int a, int b, Vector2d centre = {0, 0}) {
  const auto binomial = [](int n, int k) {
    Rational c = 1;
    for (int i = 1; i <= k; ++i) c = c * (n - k + i) / i;
    return c;
  };
  const auto raise = [](const Rational& x, int n) {
    Rational y = 1;
    for (int k = 0; k < n; ++k) y *= x;
    return y;
  };
  Rational total = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vector2d& p = corners[k];
    const Vector2d& q = corners[(k + 1) % corners.size()];
    const Rational u = Rational(p.x()) - Rational(centre.x()), v = Rational(p.y()) - Rational(centre.y());
    const Rational du = Rational(q.x()) - Rational(p.x()), dv = Rational(q.y()) - Rational(p.y());
    Rational edge = 0;
    for (int i = 0; i <= a + 1; ++i)
      for (int j = 0; j <= b; ++j)
        edge += binomial(a + 1, i) * binomial(b, j) * raise(u, a + 1 - i) * raise(du, i) * raise(v, b - j) *
                raise(dv, j) / (i + j + 1);
    total += edge * dv / (a + 1);
  }
  return total;
}

// The laws of every rule on cut cells.
inline void expect_lawful(const CutQuadrature& rule, int degree, const std::function<bool(double, double)>& inside,
                          double residual = 1e-13) {
  ASSERT_FALSE(rule.cells.empty());
  double total = 0;
  for (const CellRule& cell : rule.cells) {
    EXPECT_LE(cell.count, (2 * degree + 1) * (2 * degree + 1));
    EXPECT_GE(cell.count, 1);
    double area = 0;
    for (int k = cell.first; k < cell.first + cell.count; ++k) area += rule.weights[k];
    expect_near_rel(area, cell.area, 1e-13);
    total += cell.area;
  }
  expect_near_rel(rule.area, total, 1e-13);
  for (std::size_t k = 0; k < rule.points.size(); ++k) {
    EXPECT_GT(rule.weights[k], 0) << k;
    EXPECT_TRUE(inside(rule.points[k].x(), rule.points[k].y())) << rule.points[k].transpose();
  }
  EXPECT_LE(rule.moment_residual, residual);
}

}  // namespace toile::test
