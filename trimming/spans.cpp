// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/spans.h"

#include <algorithm>
#include <cmath>

#include "geometry/finite.h"

namespace toile {
namespace {

// An unevaluated sum hi + lo, |lo| <= ulp(hi)/2: about 104 bits. [Dekker 1971; Knuth, two-sum]
struct Wide {
  double hi = 0, lo = 0;
};

Wide two_sum(double a, double b) {
  const double s = a + b;
  const double t = s - a;
  return {s, (a - (s - t)) + (b - t)};
}

Wide operator+(Wide a, Wide b) {
  Wide s = two_sum(a.hi, b.hi);
  const Wide t = two_sum(a.lo, b.lo);
  s = two_sum(s.hi, s.lo + t.hi);
  return two_sum(s.hi, s.lo + t.lo);
}

Wide operator-(Wide a, Wide b) {
  return a + Wide{-b.hi, -b.lo};
}

Wide operator*(Wide a, Wide b) {
  const double p = a.hi * b.hi;
  return two_sum(p, std::fma(a.hi, b.hi, -p) + (a.hi * b.lo + a.lo * b.hi));
}

Wide operator/(Wide a, Wide b) {
  const double q1 = a.hi / b.hi;
  Wide r = a - Wide{q1} * b;
  const double q2 = r.hi / b.hi;
  r = r - Wide{q2} * b;
  return Wide{q1} + Wide{q2} + Wide{r.hi / b.hi};
}

// A point in the plane times its weight, and the weight.
struct Homogeneous {
  Wide x, y, w;
};

// Exactly a where the ends agree.
Wide lerp(Wide a, Wide b, Wide s) {
  return a + s * (b - a);
}

// Bezier control point k of knot span i: the blossom at (min, ..., min, max, ..., max) with k times max.
Homogeneous blossom(const Curve2& curve, bool rational, int i, int k) {
  const int p = curve.degree();
  const KnotVector& knots = curve.knots();
  std::array<Homogeneous, max_degree + 1> d;
  for (int j = 0; j <= p; ++j) {
    const int c = i - p + j;
    const Wide w{rational ? curve.weight(c) : 1.0};
    d[static_cast<std::size_t>(j)] = {Wide{curve.points()(0, c)} * w, Wide{curve.points()(1, c)} * w, w};
  }
  for (int r = 1; r <= p; ++r) {
    const Wide x{r <= p - k ? knots[i] : knots[i + 1]};
    for (int j = p; j >= r; --j) {
      const Wide a{knots[i - p + j]}, b{knots[j + 1 + i - r]};
      const Wide s = (x - a) / (b - a);
      Homogeneous& to = d[static_cast<std::size_t>(j)];
      const Homogeneous& from = d[static_cast<std::size_t>(j - 1)];
      to.x = lerp(from.x, to.x, s);
      to.y = lerp(from.y, to.y, s);
      if (rational) to.w = lerp(from.w, to.w, s);
    }
  }
  return d[static_cast<std::size_t>(p)];
}

bool has_bezier_knots(const KnotVector& knots, int i) {
  for (int k = 1; k < knots.degree(); ++k) {
    if (knots[i - k] != knots[i] || knots[i + 1 + k] != knots[i + 1]) return false;
  }
  return true;
}

}  // namespace

double TrimSpan::t(double s) const {
  if (s <= 0) return range.min;
  if (s >= 1) return range.max;
  return std::clamp(range.min + s * range.length(), range.min, range.max);
}

Eigen::Vector2d TrimSpan::at(double s) const {
  if (s <= 0) return first();
  if (s >= 1) return last();
  std::array<Eigen::Vector3d, max_degree + 1> d;
  for (std::size_t i = 0; i <= static_cast<std::size_t>(degree); ++i)
    d[i] = Eigen::Vector3d(u[i] * w[i], v[i] * w[i], w[i]);
  for (int r = degree; r > 0; --r) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(r); ++i) d[i] = (1 - s) * d[i] + s * d[i + 1];
  }
  return d[0].head<2>() / d[0].z();
}

bool TrimSpan::degenerate() const {
  for (int i = 1; i <= degree; ++i) {
    if (point(i) != first()) return false;
  }
  return true;
}

std::vector<TrimSpan> trim_spans(const Curve2& curve, int loop, int curve_position) {
  const KnotVector& knots = curve.knots();
  const int p = curve.degree();
  const bool rational = curve.rational();
  std::vector<TrimSpan> spans;
  for (const int i : knots.spans()) {
    TrimSpan span;
    span.loop = loop;
    span.curve = curve_position;
    span.range = {knots[i], knots[i + 1]};
    span.degree = p;
    const bool given = has_bezier_knots(knots, i);
    for (int k = 0; k <= p; ++k) {
      const std::size_t at = static_cast<std::size_t>(k);
      const int c = i - p + k;
      // At a knot of multiplicity p the curve passes its control point.
      const bool at_point = (k == 0 && knots[i - p + 1] == knots[i]) || (k == p && knots[i + p] == knots[i + 1]);
      if (given || at_point) {
        span.u[at] = curve.points()(0, c);
        span.v[at] = curve.points()(1, c);
        span.w[at] = rational ? curve.weight(c) : 1.0;
      } else if (k == 0 && !spans.empty()) {
        const std::size_t end = static_cast<std::size_t>(p);
        span.u[at] = spans.back().u[end];
        span.v[at] = spans.back().v[end];
        span.w[at] = spans.back().w[end];
      } else {
        const Homogeneous h = blossom(curve, rational, i, k);
        span.u[at] = rational ? (h.x / h.w).hi : h.x.hi;
        span.v[at] = rational ? (h.y / h.w).hi : h.y.hi;
        span.w[at] = h.w.hi;
      }
      require_finite(span.point(k), "a Bezier point of a trim");
      require_finite(span.w[at], "a weight of a trim");
    }
    spans.push_back(span);
  }
  return spans;
}

TrimSpans trim_spans(const std::vector<TrimLoop>& loops) {
  TrimSpans out;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    std::vector<int>& first = out.first.emplace_back();
    for (std::size_t c = 0; c < loops[l].curves.size(); ++c) {
      first.push_back(static_cast<int>(out.all.size()));
      for (const TrimSpan& span : trim_spans(loops[l].curves[c].curve, static_cast<int>(l), static_cast<int>(c))) {
        out.all.push_back(span);
      }
    }
    first.push_back(static_cast<int>(out.all.size()));
  }
  return out;
}

std::span<const TrimSpan> TrimSpans::of(int loop, int curve) const {
  const std::vector<int>& f = first[static_cast<std::size_t>(loop)];
  const std::size_t c = static_cast<std::size_t>(curve);
  return std::span(all).subspan(static_cast<std::size_t>(f[c]), static_cast<std::size_t>(f[c + 1] - f[c]));
}

std::span<const TrimSpan> TrimSpans::of(int loop) const {
  const std::vector<int>& f = first[static_cast<std::size_t>(loop)];
  return std::span(all).subspan(static_cast<std::size_t>(f.front()), static_cast<std::size_t>(f.back() - f.front()));
}

bool against_the_file(const TrimLoop& loop) {
  return loop.curves.size() == 1 ? loop.curves.front().reversed : loop.curves.front().index > loop.curves.back().index;
}

}  // namespace toile
