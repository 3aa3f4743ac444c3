// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/model_curve.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "geometry/cubic_fit.h"

namespace toile::iges {

namespace {

struct Spans {
  int u, v;
  bool operator==(const Spans&) const = default;
};

// S(c(t)) on one smooth piece: a Bezier piece of c over one pair of spans of S, so that derivatives at its ends are
// one-sided.
struct SmoothPiece {
  const NurbsSurface* surface;
  Curve2 curve;
  Interval range;
  Spans spans;
};

Spans spans_at(const NurbsSurface& s, const Curve2& c, double t) {
  const Eigen::Vector2d p = c(t);
  return {s.u().find_span(p.x()), s.v().find_span(p.y())};
}

PathPoint<3> evaluate(const SmoothPiece& piece, double t) {
  const CurveJet<2> c = toile::evaluate(piece.curve, t);
  const NurbsSurface& s = *piece.surface;
  if ((s.u().degree() + 1) * (s.v().degree() + 1) > SurfaceBasis::capacity || s.u().degree() > 7 ||
      s.v().degree() > 7) {
    const SurfaceJet jet = toile::evaluate(s, c.x.x(), c.x.y());
    return {jet.x, jet.u * c.d1.x() + jet.v * c.d1.y()};
  }
  SurfaceBasis basis;
  evaluate_basis_on_span(s, piece.spans.u, piece.spans.v, c.x.x(), c.x.y(), basis);
  PathPoint<3> out{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (int b = 0; b < basis.count_v; ++b)
    for (int a = 0; a < basis.count_u; ++a) {
      const auto k = static_cast<std::size_t>(a + basis.count_u * b);
      const Eigen::Vector3d point = s.points().col(s.index(basis.first_u + a, basis.first_v + b));
      out.x += basis.value[0][k] * point;
      out.d += (basis.value[1][k] * c.d1.x() + basis.value[2][k] * c.d1.y()) * point;
    }
  return out;
}

// Where the spans under c change between samples, found by halving. These places only make the fit cheap: one that is
// missed costs further halvings of the fit.
void add_crossings(const NurbsSurface& s, const Curve2& c, Interval range, std::vector<double>& breaks) {
  constexpr int samples = 32;
  const double shortest = 1e-7 * range.length();
  double a = range.min;
  Spans from = spans_at(s, c, a + shortest);
  for (int i = 1; i <= samples; ++i) {
    const double end = i == samples ? range.max : range.min + range.length() * i / samples;
    const double probe = std::min(end, range.max - shortest);
    for (int crossings = 0; crossings < 16 && !(spans_at(s, c, probe) == from); ++crossings) {
      double low = a, high = probe;
      while (high - low > 1e-15 * range.length()) {
        const double middle = 0.5 * (low + high);
        if (middle <= low || middle >= high) break;
        (spans_at(s, c, middle) == from ? low : high) = middle;
      }
      a = high;
      from = spans_at(s, c, std::min(high + shortest, range.max));
      if (high - breaks.back() > shortest && range.max - high > shortest) breaks.push_back(high);
    }
    a = probe;
  }
}

double distance(const Curve3& curve, const NurbsSurface& s, const Curve2& c) {
  constexpr int samples = 16;
  double largest = 0;
  for (int i : curve.knots().spans()) {
    const double a = curve.knots()[i], b = curve.knots()[i + 1];
    for (int k = 0; k <= samples; ++k) {
      const double t = k == samples ? b : a + (b - a) * k / samples;
      const Eigen::Vector2d p = c(t);
      largest = std::max(largest, (curve(t) - s(p.x(), p.y())).norm());
    }
  }
  return largest;
}

}  // namespace

ModelCurve fit_model_curve(const NurbsSurface& surface, const Curve2& c, double tolerance,
                           const std::optional<AffinePatch>& patch) {
  ModelCurve out;
  if (patch) {
    Eigen::Matrix<double, 3, 2> map;
    map << patch->du, patch->dv;
    out.curve = Curve3(c.knots(), Curve3::Points((map * c.points()).colwise() + patch->origin), c.weights());
  } else {
    // Far from the origin the places themselves are no finer.
    const double rounding = 64 * std::numeric_limits<double>::epsilon() * surface.points().cwiseAbs().maxCoeff();
    tolerance = std::max(tolerance, rounding);
    std::vector<SmoothPath<3>> path;
    for (const BezierCurve<2>& bezier : bezier_pieces(c)) {
      const auto degree = static_cast<int>(bezier.points.cols()) - 1;
      std::vector<double> knots(static_cast<std::size_t>(degree) + 1, bezier.range.min);
      knots.insert(knots.end(), static_cast<std::size_t>(degree) + 1, bezier.range.max);
      SmoothPiece piece{&surface,
                        Curve2(KnotVector(degree, std::move(knots)), bezier.points,
                               std::vector<double>(bezier.weights.begin(), bezier.weights.end())),
                        bezier.range,
                        {}};
      std::vector<double> breaks{bezier.range.min};
      add_crossings(surface, piece.curve, bezier.range, breaks);
      breaks.push_back(bezier.range.max);
      for (std::size_t i = 0; i + 1 < breaks.size(); ++i) {
        const Interval range{breaks[i], breaks[i + 1]};
        piece.spans = spans_at(surface, piece.curve, 0.5 * (range.min + range.max));
        path.push_back({range, [piece](double t) { return evaluate(piece, t); }});
      }
    }
    out.curve = fit_cubic<3>(path, {.tolerance = tolerance}).curve;
  }
  out.error = distance(out.curve, surface, c);
  return out;
}

}  // namespace toile::iges
