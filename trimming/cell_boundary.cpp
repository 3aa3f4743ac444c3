// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/cell_boundary.h"

#include <algorithm>
#include <cmath>

#include "trimming/gauss.h"

namespace toile {
namespace {

using Real = BoundaryBezier::Real;
using Homogeneous = std::array<Real, 3>;

// Control points of the part of the curve over [a, b] inside one knot span: the blossom at (a, .., a, b, .., b).
// [Piegl & Tiller 1997, 5.3; Ramshaw 1987]
BoundaryBezier span_piece(const Curve2& curve, int span, double a, double b, const Eigen::Vector2d& origin) {
  const int p = curve.degree();
  const KnotVector& knots = curve.knots();
  BoundaryBezier piece;
  piece.degree = p;
  piece.rational = curve.rational();
  piece.trim = true;
  std::array<Homogeneous, max_degree + 1> control, d;
  for (int j = 0; j <= p; ++j) {
    const int k = span - p + j;
    const Real w = piece.rational ? curve.weight(k) : 1.0;
    control[j] = {w * (Real(curve.points()(0, k)) - Real(origin.x())),
                  w * (Real(curve.points()(1, k)) - Real(origin.y())), w};
  }
  for (int k = 0; k <= p; ++k) {
    d = control;
    for (int r = 1; r <= p; ++r) {
      const Real argument = r <= p - k ? a : b;
      for (int j = p; j >= r; --j) {
        const int i = span - p + j;
        const Real left = knots[i], right = knots[i + p - r + 1];
        const Real alpha = (argument - left) / (right - left);
        // exact at alpha 0 and 1, however much smaller one of the two is
        for (int c = 0; c < 3; ++c) d[j][c] = (1 - alpha) * d[j - 1][c] + alpha * d[j][c];
      }
    }
    piece.x[k] = d[p][0];
    piece.y[k] = d[p][1];
    piece.w[k] = d[p][2];
  }
  return piece;
}

void reverse(BoundaryBezier& piece) {
  for (auto* values : {&piece.x, &piece.y, &piece.w}) std::reverse(values->begin(), values->begin() + piece.degree + 1);
}

// Weights that differ leave most of a piece to a sliver of its parameters, which quadrature passes over: w_k c^k are
// weights of the same piece, with c such that both ends are equal [Piegl & Tiller 1997, 6.5], and each half of that has
// weights closer to each other. Halves until they differ by less than `widest`.
void append_even(BoundaryBezier piece, std::vector<BoundaryBezier>& out) {
  constexpr Real widest = 4;
  const int d = piece.degree;
  const auto uneven = [&] {
    const auto [low, high] = std::minmax_element(piece.w.begin(), piece.w.begin() + d + 1);
    return *high >= widest * *low;
  };
  if (!piece.rational || !uneven()) {
    out.push_back(piece);
    return;
  }
  const Real c = std::pow(piece.w[0] / piece.w[d], Real(1) / d);
  Real factor = 1;
  for (int k = 1; k <= d; ++k) {
    factor *= c;
    for (auto* values : {&piece.x, &piece.y, &piece.w}) (*values)[k] *= factor;
  }
  if (!uneven()) {
    out.push_back(piece);
    return;
  }
  BoundaryBezier first = piece;
  for (const auto values : {&BoundaryBezier::x, &BoundaryBezier::y, &BoundaryBezier::w}) {
    auto& rest = piece.*values;
    for (int r = 1; r <= d; ++r) {
      for (int j = 0; j <= d - r; ++j) rest[j] = (rest[j] + rest[j + 1]) / 2;
      (first.*values)[r] = rest[0];
    }
  }
  append_even(first, out);
  append_even(piece, out);
}

BoundaryBezier straight_piece(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Eigen::Vector2d& origin) {
  BoundaryBezier piece;
  piece.x = {Real(from.x()) - origin.x(), Real(to.x()) - origin.x()};
  piece.y = {Real(from.y()) - origin.y(), Real(to.y()) - origin.y()};
  piece.w = {1, 1};
  return piece;
}

// Sum over Gauss points of A_a(x) P_b(y) dy, A_a the antiderivative of P_a, added to `sums` over t in [t0, t1].
void add_green(const BoundaryBezier& piece, Real t0, Real t1, int n, int degree_x, int degree_y, Real* sums) {
  const GaussRule& rule = gauss_rule(n);
  std::array<Real, 64> antiderivative;
  const Real half = (t1 - t0) / 2, middle = (t0 + t1) / 2;
  for (int q = 0; q < n; ++q) {
    const BoundaryJet jet = evaluate(piece, middle + half * rule.node[q]);
    const Real scale = rule.weight[q] * half * jet.dy;
    // (2a + 1) P_a = P'_{a+1} - P'_{a-1}
    Real before = 1, value = jet.x;
    antiderivative[0] = jet.x;
    for (int a = 1; a <= degree_x; ++a) {
      const Real next = ((2 * a + 1) * jet.x * value - a * before) / (a + 1);
      antiderivative[a] = (next - before) / (2 * a + 1);
      before = value;
      value = next;
    }
    before = 0;
    value = scale;
    Real* row = sums;
    for (int b = 0; b <= degree_y; ++b, row += degree_x + 1) {
      for (int a = 0; a <= degree_x; ++a) row[a] += antiderivative[a] * value;
      const Real next = ((2 * b + 1) * jet.y * value - b * before) / (b + 1);
      before = value;
      value = next;
    }
  }
}

// The same of a piece along x = const, in closed form: the integral of P_b is (P_{b+1} - P_{b-1}) / (2b + 1).
void add_upright(const BoundaryBezier& piece, int degree_x, int degree_y, Real* sums) {
  const Real x = piece.x[0];
  std::array<Real, 64> antiderivative;
  Real before = 1, value = x;
  antiderivative[0] = x;
  for (int a = 1; a <= degree_x; ++a) {
    const Real next = ((2 * a + 1) * x * value - a * before) / (a + 1);
    antiderivative[a] = (next - before) / (2 * a + 1);
    before = value;
    value = next;
  }
  const Real y0 = piece.y[0], y1 = piece.y[1];
  Real before0 = 1, value0 = y0, before1 = 1, value1 = y1;  // P_{b-1}, P_b at both ends, from b = 1
  for (int a = 0; a <= degree_x; ++a) sums[a] += antiderivative[a] * (y1 - y0);
  for (int b = 1; b <= degree_y; ++b) {
    const Real next0 = ((2 * b + 1) * y0 * value0 - b * before0) / (b + 1);
    const Real next1 = ((2 * b + 1) * y1 * value1 - b * before1) / (b + 1);
    const Real integral = ((next1 - before1) - (next0 - before0)) / (2 * b + 1);
    for (int a = 0; a <= degree_x; ++a) sums[a + (degree_x + 1) * b] += antiderivative[a] * integral;
    before0 = value0;
    value0 = next0;
    before1 = value1;
    value1 = next1;
  }
}

// Halves a piece until Gauss on it and on its halves agree to rounding.
void add_green_adaptively(const BoundaryBezier& piece, Real t0, Real t1, int n, int degree_x, int degree_y, int depth,
                          std::span<const Real> whole, std::span<Real> sums) {
  const Real middle = (t0 + t1) / 2;
  std::vector<Real> left(whole.size(), 0), right(whole.size(), 0);
  add_green(piece, t0, middle, n, degree_x, degree_y, left.data());
  add_green(piece, middle, t1, n, degree_x, degree_y, right.data());
  Real difference = 0;
  for (std::size_t k = 0; k < whole.size(); ++k)
    difference = std::max(difference, std::abs(left[k] + right[k] - whole[k]));
  if (difference < Real(1e-17) || depth == 0) {
    for (std::size_t k = 0; k < whole.size(); ++k) sums[k] += left[k] + right[k];
    return;
  }
  add_green_adaptively(piece, t0, middle, n, degree_x, degree_y, depth - 1, left, sums);
  add_green_adaptively(piece, middle, t1, n, degree_x, degree_y, depth - 1, right, sums);
}

}  // namespace

void append_pieces(const TrimmedSurface& surface, const BoundaryPiece& piece, const Eigen::Vector2d& origin,
                   std::vector<BoundaryBezier>& out) {
  if (piece.curve < 0 || piece.t0 == piece.t1) {
    if (piece.from != piece.to) {
      out.push_back(straight_piece(piece.from, piece.to, origin));
      out.back().trim = piece.curve >= 0;
    }
    return;
  }
  const Curve2& curve = surface.loops[piece.loop].curves[piece.curve].curve;
  const KnotVector& knots = curve.knots();
  const double low = std::min(piece.t0, piece.t1), high = std::max(piece.t0, piece.t1);
  const auto first = static_cast<std::ptrdiff_t>(out.size());
  const int last_span = knots.find_span(knots.domain().max);
  int span = knots.find_span(low);
  for (double a = low; a < high;) {
    const double b = span >= last_span ? high : std::min(knots[span + 1], high);
    append_even(span_piece(curve, span, a, b, origin), out);
    a = b;
    while (span < last_span && knots[span + 1] <= a) ++span;
  }
  if (piece.t0 > piece.t1) {
    std::reverse(out.begin() + first, out.end());
    std::for_each(out.begin() + first, out.end(), reverse);
  }
  // The ends are the event's rounded coordinates, which the neighbour shares; joints between knot spans agree likewise.
  BoundaryBezier& head = out[first];
  head.x[0] = head.w[0] * (Real(piece.from.x()) - origin.x());
  head.y[0] = head.w[0] * (Real(piece.from.y()) - origin.y());
  BoundaryBezier& tail = out.back();
  tail.x[tail.degree] = tail.w[tail.degree] * (Real(piece.to.x()) - origin.x());
  tail.y[tail.degree] = tail.w[tail.degree] * (Real(piece.to.y()) - origin.y());
  for (auto k = static_cast<std::size_t>(first) + 1; k < out.size(); ++k) {
    const BoundaryBezier& before = out[k - 1];
    const int d = before.degree;
    out[k].x[0] = before.x[d] * out[k].w[0] / before.w[d];
    out[k].y[0] = before.y[d] * out[k].w[0] / before.w[d];
  }
}

void build_boundary(const TrimmedSurface& surface, const KnotMesh& mesh, const CutCell& cell, CellBoundary& out) {
  out.u = {mesh.u[cell.i], mesh.u[cell.i + 1]};
  out.v = {mesh.v[cell.j], mesh.v[cell.j + 1]};
  out.pieces.clear();
  out.chain_ends.clear();
  out.origin =
      cell.loops.empty() || cell.loops[0].empty() ? Eigen::Vector2d(out.u.min, out.v.min) : cell.loops[0][0].from;
  for (const auto& loop : cell.loops) {
    for (const BoundaryPiece& piece : loop) append_pieces(surface, piece, out.origin, out.pieces);
    out.chain_ends.push_back(static_cast<int>(out.pieces.size()));
  }
}

BoundaryJet evaluate(const BoundaryBezier& piece, Real t) {
  const int d = piece.degree;
  if (d == 1 && !piece.rational) {
    const Real dx = piece.x[1] - piece.x[0], dy = piece.y[1] - piece.y[0];
    return {piece.x[0] + t * dx, piece.y[0] + t * dy, dx, dy};
  }
  if (d == 0) return {piece.x[0] / piece.w[0], piece.y[0] / piece.w[0], 0, 0};
  auto x = piece.x, y = piece.y;
  for (int r = d; r > 1; --r)
    for (int j = 0; j < r; ++j) {
      x[j] += t * (x[j + 1] - x[j]);
      y[j] += t * (y[j + 1] - y[j]);
    }
  const Real dx = d * (x[1] - x[0]), dy = d * (y[1] - y[0]);
  const Real px = x[0] + t * (x[1] - x[0]), py = y[0] + t * (y[1] - y[0]);
  if (!piece.rational) return {px, py, dx, dy};
  auto w = piece.w;
  for (int r = d; r > 1; --r)
    for (int j = 0; j < r; ++j) w[j] += t * (w[j + 1] - w[j]);
  const Real dw = d * (w[1] - w[0]), pw = w[0] + t * (w[1] - w[0]);
  const Real ex = px / pw, ey = py / pw;
  return {ex, ey, (dx - ex * dw) / pw, (dy - ey * dw) / pw};
}

BoundaryBox box_of(const CellBoundary& boundary) {
  const Real u0 = Real(boundary.u.min) - boundary.origin.x(), u1 = Real(boundary.u.max) - boundary.origin.x();
  const Real v0 = Real(boundary.v.min) - boundary.origin.y(), v1 = Real(boundary.v.max) - boundary.origin.y();
  Real x0 = u1, x1 = u0, y0 = v1, y1 = v0;
  for (const BoundaryBezier& piece : boundary.pieces)
    for (int k = 0; k <= piece.degree; ++k) {
      const Real x = std::clamp(piece.x[k] / piece.w[k], u0, u1), y = std::clamp(piece.y[k] / piece.w[k], v0, v1);
      x0 = std::min(x0, x);
      x1 = std::max(x1, x);
      y0 = std::min(y0, y);
      y1 = std::max(y1, y);
    }
  return {(x0 + x1) / 2, (y0 + y1) / 2, (x1 - x0) / 2, (y1 - y0) / 2};
}

void scale_to_box(CellBoundary& boundary, const BoundaryBox& box) {
  for (BoundaryBezier& piece : boundary.pieces)
    for (int k = 0; k <= piece.degree; ++k) {
      piece.x[k] = (piece.x[k] - box.centre_x * piece.w[k]) / box.half_x;
      piece.y[k] = (piece.y[k] - box.centre_y * piece.w[k]) / box.half_y;
    }
}

void legendre_moments(std::span<const BoundaryBezier> pieces, int degree_x, int degree_y, std::vector<Real>& moments) {
  const std::size_t count = static_cast<std::size_t>(degree_x + 1) * (degree_y + 1);
  moments.assign(count, 0);
  std::vector<Real> whole;
  for (const BoundaryBezier& piece : pieces) {
    const int d = piece.degree;
    if (d == 1 && piece.y[0] == piece.y[1] && !piece.rational) continue;
    if (d == 1 && piece.x[0] == piece.x[1] && !piece.rational) {
      add_upright(piece, degree_x, degree_y, moments.data());
      continue;
    }
    // The integrand has degree d (degree_x + degree_y + 2) - 1 in t.
    const int exact = (d * (degree_x + degree_y + 2) + 1) / 2;
    if (!piece.rational && exact <= max_gauss_points) {
      add_green(piece, 0, 1, exact, degree_x, degree_y, moments.data());
      continue;
    }
    const int n = std::min(exact + 4, 40);
    whole.assign(count, 0);
    add_green(piece, 0, 1, n, degree_x, degree_y, whole.data());
    add_green_adaptively(piece, 0, 1, n, degree_x, degree_y, 10, whole, moments);
  }
}

double material_area(const TrimmedSurface& surface, const KnotMesh& mesh, const CutCell& cell) {
  CellBoundary boundary;
  build_boundary(surface, mesh, cell, boundary);
  if (boundary.pieces.empty()) return 0;
  const BoundaryBox box = box_of(boundary);
  if (!(box.half_x > 0 && box.half_y > 0)) return 0;
  scale_to_box(boundary, box);
  std::vector<Real> moments;
  legendre_moments(boundary.pieces, 0, 0, moments);
  return static_cast<double>(moments[0] * box.half_x * box.half_y);
}

}  // namespace toile
