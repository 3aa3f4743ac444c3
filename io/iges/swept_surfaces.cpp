// SPDX-License-Identifier: GPL-3.0-or-later
// Entities 118 (ruled surface), 120 (surface of revolution), 122 (tabulated cylinder). [IGES 5.3, 4.17, 4.18, 4.19]
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "geometry/surface_fit.h"
#include "io/iges/splines.h"
#include "io/iges/surfaces.h"

namespace toile::iges {

NaturalCurve joined(const std::vector<NaturalCurve>& pieces, double tolerance) {
  if (pieces.size() == 1) return pieces[0];
  int degree = 1;
  bool rational = false;
  for (const NaturalCurve& piece : pieces) {
    degree = std::max(degree, piece.curve.degree());
    rational = rational || piece.curve.rational();
  }
  NaturalCurve out;
  std::vector<double> knots, weights;
  std::vector<Eigen::Vector3d> points;
  double at = 0;
  for (const NaturalCurve& piece : pieces) {
    const Interval own = piece.curve.domain();
    const double shift = at - own.min;
    const Curve3 c = with_domain(elevate_degree(clamp(piece.curve), degree), {at, at + own.length()});
    const auto k = c.knots().knots();
    // The joint is one control point, and a knot as often as the degree.
    const bool first = points.empty();
    if (!first && (points.back() - c.points().col(0)).norm() > tolerance)
      throw GeometryError("the pieces of a composite curve leave a gap of " +
                          format_real((points.back() - c.points().col(0)).norm()));
    if (!first) knots.pop_back();
    knots.insert(knots.end(), k.begin() + (first ? 0 : degree + 1), k.end());
    const double ratio = first ? 1 : weights.back() / c.weight(0);
    for (int i = first ? 0 : 1; i < c.knots().control_point_count(); ++i) {
      points.push_back(c.points().col(i));
      weights.push_back(ratio * c.weight(i));
    }
    for (const Turn& turn : piece.turns)
      out.turns.push_back({{turn.range.min + shift, turn.range.max + shift}, turn.arcs, turn.sweep});
    at += own.length();
  }
  Eigen::Matrix3Xd net(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) net.col(static_cast<Eigen::Index>(i)) = points[i];
  if (!rational) weights.clear();
  out.curve = Curve3(KnotVector(degree, std::move(knots)), std::move(net), std::move(weights));
  return out;
}

namespace {

// The same curve counted from 0 to 1, and the map from there.
struct UnitCurve {
  Curve3 curve;
  AxisMap map;
};
UnitCurve over_unit(const NaturalCurve& c) {
  const Interval d = c.curve.domain();
  UnitCurve out{with_domain(clamp(c.curve), {0, 1}), {}};
  for (const Turn& turn : c.turns)
    out.map.turns.push_back(
        {{(turn.range.min - d.min) / d.length(), (turn.range.max - d.min) / d.length()}, turn.arcs, turn.sweep});
  return out;
}

bool same(const std::vector<Turn>& a, const std::vector<Turn>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Turn& x, const Turn& y) {
    return std::abs(x.range.min - y.range.min) <= 1e-12 && std::abs(x.range.max - y.range.max) <= 1e-12 &&
           x.arcs == y.arcs && std::abs(x.sweep - y.sweep) <= 1e-12;
  });
}

// Knots of `from` that `to` lacks, those within rounding of one that it has left out.
std::vector<double> lacking(const Curve3& from, const Curve3& to) {
  std::vector<double> out;
  const std::vector<double> own = to.knots().breaks();
  for (const double b : from.knots().breaks()) {
    const auto near = std::find_if(own.begin(), own.end(), [&](double x) { return std::abs(x - b) <= 1e-12; });
    const int have = near == own.end() ? 0 : to.knots().multiplicity(*near);
    for (int k = have; k < from.knots().multiplicity(b) && 0 < b && b < 1; ++k)
      out.push_back(near == own.end() ? b : *near);
  }
  return out;
}

// Both curves on the knots of both; false where their knots are equal but for rounding and can't be made one.
bool made_compatible(Curve3& a, Curve3& b) {
  const int degree = std::max(a.degree(), b.degree());
  a = elevate_degree(a, degree);
  b = elevate_degree(b, degree);
  const std::vector<double> for_a = lacking(b, a), for_b = lacking(a, b);
  a = insert_knots(a, std::span<const double>(for_a));
  b = insert_knots(b, std::span<const double>(for_b));
  if (a.knots().control_point_count() != b.knots().control_point_count()) return false;
  b = Curve3(a.knots(), b.points(), b.weights());  // knots within 1e-12 of the domain
  return true;
}

// Fractions of arc length, tabulated at places fine enough for Newton's method to start from.
class ArcLength {
 public:
  explicit ArcLength(const Curve3& curve) : curve_(curve) {
    const std::vector<double> breaks = curve.knots().breaks();
    t_.push_back(breaks.front());
    s_.push_back(0);
    for (std::size_t i = 0; i + 1 < breaks.size(); ++i)
      for (int k = 1; k <= 16; ++k) {
        t_.push_back(k == 16 ? breaks[i + 1] : breaks[i] + (breaks[i + 1] - breaks[i]) * k / 16);
        s_.push_back(s_.back() + arc_length(curve, {t_[t_.size() - 2], t_.back()}, tolerance));
      }
    if (!(s_.back() > 0)) throw GeometryError("a curve of the ruled surface has no length");
  }
  double parameter(double fraction) {
    const auto [known, added] = known_.try_emplace(fraction, 0.0);
    if (added) known->second = find(fraction);
    return known->second;
  }

 private:
  double find(double fraction) const {
    const double s = fraction * s_.back();
    const auto above = static_cast<std::size_t>(std::lower_bound(s_.begin(), s_.end(), s) - s_.begin());
    if (above == 0) return t_.front();
    if (above == s_.size()) return t_.back();
    const double a = t_[above - 1], b = t_[above];
    double t = a + (b - a) * (s - s_[above - 1]) / (s_[above] - s_[above - 1]);
    for (int k = 0; k < 20; ++k) {
      const double speed = evaluate(curve_, t).d1.norm();
      if (!(speed > 0)) break;
      const double step = (s - s_[above - 1] - arc_length(curve_, {a, t}, tolerance)) / speed;
      t = std::clamp(t + step, a, b);
      if (std::abs(step) <= 1e-12 * (b - a)) break;
    }
    return t;
  }

  static constexpr double tolerance = 1e-9;  // far below what files resolve
  const Curve3& curve_;
  std::vector<double> t_, s_;
  std::map<double, double> known_;  // a fit asks for the same fractions again and again
};

// The ruled surface between rational curves on one knot vector: over the product of their weights, which are the two
// edges' common denominator, it is of twice their degree, exactly.
NurbsSurface ruled_over_product(const Curve3& a, const Curve3& b) {
  const int p = a.degree(), q = 2 * p;
  const std::vector<BezierCurve<3>> pieces_a = bezier_pieces(a), pieces_b = bezier_pieces(b);
  const auto choose = [](int n, int k) {
    double out = 1;
    for (int i = 1; i <= k; ++i) out = out * (n - k + i) / i;
    return out;
  };
  std::vector<double> knots(1, a.domain().min), weights;
  std::array<std::vector<Eigen::Vector3d>, 2> edges;
  for (std::size_t s = 0; s < pieces_a.size(); ++s) {
    const BezierCurve<3>&x = pieces_a[s], &y = pieces_b[s];
    knots.insert(knots.end(), static_cast<std::size_t>(q), x.range.min);
    for (int k = s == 0 ? 0 : 1; k <= q; ++k) {
      double w = 0;
      Eigen::Vector3d on_a = Eigen::Vector3d::Zero(), on_b = on_a;
      for (int i = std::max(0, k - p); i <= std::min(k, p); ++i) {
        const double share = choose(p, i) * choose(p, k - i) / choose(q, k);
        w += share * x.weights[i] * y.weights[k - i];
        on_a += share * x.weights[i] * y.weights[k - i] * x.points.col(i);
        on_b += share * x.weights[k - i] * y.weights[i] * y.points.col(i);
      }
      weights.push_back(w);
      edges[0].push_back(on_a / w);
      edges[1].push_back(on_b / w);
    }
  }
  knots.insert(knots.end(), static_cast<std::size_t>(q) + 1, a.domain().max);
  const auto n = static_cast<Eigen::Index>(weights.size());
  Eigen::Matrix3Xd points(3, 2 * n);
  for (Eigen::Index k = 0; k < n; ++k) {
    points.col(k) = edges[0][static_cast<std::size_t>(k)];
    points.col(n + k) = edges[1][static_cast<std::size_t>(k)];
  }
  weights.insert(weights.end(), weights.begin(), weights.end());
  return NurbsSurface(KnotVector(q, std::move(knots)), KnotVector(), std::move(points), std::move(weights));
}

bool constant_speed(const NaturalCurve& c) {
  if (c.curve.degree() == 1 && c.curve.points().cols() == 2 && !c.curve.rational()) return true;
  return c.turns.size() == 1 && c.turns[0].range.min == c.curve.domain().min &&
         c.turns[0].range.max == c.curve.domain().max;
}

}  // namespace

Ruled read_ruled(Parameters& in) {
  Ruled ruled;
  ruled.first = in.pointer("DE1");
  ruled.second = in.pointer("DE2");
  ruled.direction = in.integer("DIRFLG");
  ruled.developable = in.integer("DEVFLG");
  return ruled;
}

void write(const Ruled& ruled, Record& out) {
  out.integer(ruled.first).integer(ruled.second).integer(ruled.direction).integer(ruled.developable);
}

FileSurface to_surface(const Ruled& ruled, NaturalCurve first, NaturalCurve second, bool by_length, double tolerance) {
  if (ruled.direction == 1) {
    const Interval d = second.curve.domain();
    second.curve = reversed(second.curve);
    for (Turn& turn : second.turns) turn.range = {d.min + (d.max - turn.range.max), d.min + (d.max - turn.range.min)};
    std::reverse(second.turns.begin(), second.turns.end());
  }
  UnitCurve a = over_unit(first), b = over_unit(second);
  const Interval own = first.curve.domain();
  const auto all_readings = [&](const AxisMap& map) {
    return readings({map, {0, 1}, {own, {0, own.length()}, second.curve.domain()}}, {{}, {0, 1}, {}});
  };
  if (by_length && constant_speed(first) && constant_speed(second)) by_length = false;
  FileSurface out;
  out.how = "ruled surface as B-spline surface";
  Curve3 c = a.curve, d = b.curve;
  const bool exact = !by_length && same(a.map.turns, b.map.turns) && made_compatible(c, d);
  const bool like = c.weights() == d.weights() || (!c.rational() && !d.rational());
  if (exact && !like && 2 * c.degree() <= max_degree) {
    out.surface = ruled_over_product(c, d);
    out.maps = all_readings(a.map);
    return out;
  }
  if (exact && like) {
    const int n = c.knots().control_point_count();
    Eigen::Matrix3Xd points(3, 2 * n);
    points << c.points(), d.points();
    std::vector<double> weights;
    if (c.rational()) {
      weights = c.weights();
      weights.insert(weights.end(), c.weights().begin(), c.weights().end());
    }
    out.surface = NurbsSurface(c.knots(), KnotVector(), std::move(points), std::move(weights));
    out.maps = all_readings(a.map);
    return out;
  }
  // No NURBS has these rulings in the file's parameters: a fit in those.
  std::optional<ArcLength> length_a, length_b;
  if (by_length) {
    length_a.emplace(a.curve);
    length_b.emplace(b.curve);
  }
  const auto at = [](const UnitCurve& curve, std::optional<ArcLength>& length, double u) {
    return curve.curve(length ? length->parameter(u) : curve.map(u));
  };
  std::vector<FitBreak> breaks{{0, 0}, {1, 0}};
  if (!by_length) {
    for (const UnitCurve* curve : {&a, &b})
      for (const double x : curve->curve.knots().breaks())
        if (std::none_of(breaks.begin(), breaks.end(), [&](const FitBreak& k) { return std::abs(k.at - x) <= 1e-12; }))
          breaks.push_back({x, curve->curve.degree() - curve->curve.knots().multiplicity(x)});
    std::sort(breaks.begin(), breaks.end(), [](const FitBreak& x, const FitBreak& y) { return x.at < y.at; });
  }
  const SurfaceFit fit = fit_surface(
      [&](double u, double v) -> Eigen::Vector3d { return (1 - v) * at(a, length_a, u) + v * at(b, length_b, u); },
      breaks, {{0, 0}, {1, 0}}, tolerance, by_length ? 64 : 128);
  out.surface = fit.surface;
  out.error = fit.error;
  out.maps = all_readings({});
  return out;
}

Revolution read_revolution(Parameters& in) {
  Revolution revolution;
  revolution.axis = in.pointer("L");
  revolution.generatrix = in.pointer("C");
  revolution.start = in.real("SA");
  revolution.end = in.real("TA", -1, 2 * std::numbers::pi);
  require_spans(in, {revolution.start, revolution.end}, "angle");
  return revolution;
}

void write(const Revolution& revolution, Record& out) {
  out.integer(revolution.axis).integer(revolution.generatrix).real(revolution.start).real(revolution.end);
}

NurbsSurface revolved(const Curve3& profile, const Eigen::Vector3d& origin, const Eigen::Vector3d& axis,
                      Interval angle) {
  const Curve2 arc = circular_arc({0, 0}, 1, angle.min, angle.max);
  const Eigen::Vector3d z = axis.normalized();
  const int n = profile.knots().control_point_count(), m = arc.knots().control_point_count();
  Eigen::Matrix3Xd points(3, n * m);
  std::vector<double> weights(static_cast<std::size_t>(n * m));
  for (int j = 0; j < m; ++j)
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector3d p = profile.points().col(i);
      const Eigen::Vector3d centre = origin + z * z.dot(p - origin), x = p - centre, y = z.cross(x);
      points.col(i + n * j) = centre + arc.points()(0, j) * x + arc.points()(1, j) * y;
      weights[static_cast<std::size_t>(i + n * j)] = profile.weight(i) * arc.weight(j);
    }
  return NurbsSurface(profile.knots(), with_domain(arc, angle).knots(), std::move(points), std::move(weights));
}

NurbsSurface transposed(const NurbsSurface& s) {
  Eigen::Matrix3Xd points(3, s.points().cols());
  std::vector<double> weights(s.weights().size());
  for (int j = 0; j < s.count_v(); ++j)
    for (int i = 0; i < s.count_u(); ++i) {
      points.col(j + s.count_v() * i) = s.points().col(s.index(i, j));
      if (!weights.empty()) weights[static_cast<std::size_t>(j + s.count_v() * i)] = s.weight(s.index(i, j));
    }
  return NurbsSurface(s.v(), s.u(), std::move(points), std::move(weights));
}

FileSurface to_surface(const Revolution& revolution, const Curve3& axis, const NaturalCurve& generatrix) {
  constexpr double whole = 2 * std::numbers::pi;
  const Eigen::Vector3d direction = axis.end() - axis.start();
  if (!(direction.norm() > 0)) throw GeometryError("the axis of revolution has no length");
  Interval angle{revolution.start, revolution.end};
  if (angle.max < angle.min) std::swap(angle.min, angle.max);
  if (angle.max == angle.min) angle.max += whole;
  FileSurface out;
  out.how = "surface of revolution as rational B-spline surface";
  // More than a turn covers nothing new; loops beyond the first turn are moved by a period.
  if (angle.length() > whole * (1 + 1e-6)) out.how += ", its " + format_real(angle.length() / whole) + " turns as one";
  // Full circles that are written with few digits.
  if (angle.length() > whole * (1 - 1e-9)) angle.max = angle.min + whole;
  out.surface = revolved(clamp(generatrix.curve), axis.start(), direction, angle);
  const int arcs = (out.surface.count_v() - 1) / 2;
  const Interval along = generatrix.curve.domain();
  constexpr double degree = std::numbers::pi / 180;
  out.maps =
      readings({{1, 0, generatrix.turns}, along, {{0, along.length()}, {0, 1}}},
               {{1, 0, {{angle, arcs, angle.length()}}},
                angle,
                {{0, angle.length()}, {0, 1}, {angle.min / degree, angle.max / degree}, {0, angle.length() / degree}}});
  return out;
}

Tabulated read_tabulated(Parameters& in) {
  Tabulated tabulated;
  tabulated.directrix = in.pointer("DE");
  for (int axis = 0; axis < 3; ++axis) tabulated.end[axis] = in.real("coordinate of the terminate point");
  return tabulated;
}

void write(const Tabulated& tabulated, Record& out) {
  out.integer(tabulated.directrix);
  for (int axis = 0; axis < 3; ++axis) out.real(tabulated.end[axis]);
}

FileSurface to_surface(const Tabulated& tabulated, const NaturalCurve& directrix) {
  const UnitCurve c = over_unit(directrix);
  const Eigen::Vector3d way = tabulated.end - c.curve.start();
  if (!(way.norm() > 0)) throw GeometryError("the tabulated cylinder has no height");
  Eigen::Matrix3Xd points(3, 2 * c.curve.points().cols());
  points << c.curve.points(), c.curve.points().colwise() + way;
  std::vector<double> weights = c.curve.weights();
  weights.insert(weights.end(), c.curve.weights().begin(), c.curve.weights().end());
  FileSurface out;
  out.surface = NurbsSurface(c.curve.knots(), KnotVector(), std::move(points), std::move(weights));
  const Interval own = directrix.curve.domain();
  out.maps = readings({c.map, {0, 1}, {own, {0, own.length()}}}, {{}, {0, 1}, {{0, way.norm()}}});
  out.how = "tabulated cylinder as B-spline surface";
  return out;
}

}  // namespace toile::iges
