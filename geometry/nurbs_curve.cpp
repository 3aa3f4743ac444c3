// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/nurbs_curve.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "geometry/basis.h"
#include "geometry/error.h"
#include "geometry/quadrature_rule.h"
#include "geometry/text.h"

namespace toile {

template <int Dim>
NurbsCurve<Dim>::NurbsCurve(KnotVector knots, Points points, std::vector<double> weights)
    : knots_(std::move(knots)), points_(std::move(points)), weights_(std::move(weights)) {
  const auto count = static_cast<std::size_t>(knots_.control_point_count());
  if (static_cast<std::size_t>(points_.cols()) != count)
    throw GeometryError("the knots need " + std::to_string(count) + " control points, there are " +
                        std::to_string(points_.cols()));
  if (!weights_.empty() && weights_.size() != count)
    throw GeometryError("the knots need " + std::to_string(count) + " weights, there are " +
                        std::to_string(weights_.size()));
  for (std::size_t i = 0; i < count; ++i)
    if (!points_.col(static_cast<Eigen::Index>(i)).allFinite())
      throw GeometryError("control point " + std::to_string(i) + " is not finite");
  for (std::size_t i = 0; i < weights_.size(); ++i)
    if (!(weights_[i] > 0 && std::isfinite(weights_[i])))
      throw GeometryError("weight " + std::to_string(i) + " is " + text(weights_[i]) + ", must be positive and finite");
  rational_ = std::ranges::any_of(weights_, [&](double w) { return w != weights_.front(); });
}

template <int Dim>
CurveJet<Dim> evaluate(const NurbsCurve<Dim>& curve, double t) {
  return evaluate_on_span(curve, curve.knots().find_span(t), t);
}

template <int Dim>
CurveJet<Dim> evaluate_on_span(const NurbsCurve<Dim>& curve, int span, double t) {
  BasisValues basis;
  evaluate_basis_on_span(curve.knots(), span, t, 2, basis);
  CurveJet<Dim> jet;
  jet.x.setZero();
  jet.d1.setZero();
  jet.d2.setZero();
  if (!curve.rational()) {
    for (int j = 0; j <= basis.degree; ++j) {
      const auto point = curve.points().col(basis.first + j);
      jet.x += basis.value[0][j] * point;
      jet.d1 += basis.value[1][j] * point;
      jet.d2 += basis.value[2][j] * point;
    }
    return jet;
  }
  double w = 0, w1 = 0, w2 = 0;
  for (int j = 0; j <= basis.degree; ++j) {
    const auto point = curve.points().col(basis.first + j);
    const double weight = curve.weight(basis.first + j);
    const double b0 = weight * basis.value[0][j], b1 = weight * basis.value[1][j], b2 = weight * basis.value[2][j];
    w += b0, w1 += b1, w2 += b2;
    jet.x += b0 * point;
    jet.d1 += b1 * point;
    jet.d2 += b2 * point;
  }
  // Quotient rule on homogeneous coordinates [Piegl & Tiller 1997, eq. 4.8].
  jet.x /= w;
  jet.d1 = (jet.d1 - w1 * jet.x) / w;
  jet.d2 = (jet.d2 - 2 * w1 * jet.d1 - w2 * jet.x) / w;
  return jet;
}

template <int Dim>
typename NurbsCurve<Dim>::Point NurbsCurve<Dim>::operator()(double t) const {
  BasisValues basis;
  evaluate_basis(knots_, t, 0, basis);
  Point x = Point::Zero();
  double w = 0;
  for (int j = 0; j <= basis.degree; ++j) {
    const double b = basis.value[0][j] * (rational_ ? weight(basis.first + j) : 1.0);
    w += b;
    x += b * points_.col(basis.first + j);
  }
  return rational_ ? Point(x / w) : x;
}

template <int Dim>
NurbsCurve<Dim> line_segment(const Eigen::Matrix<double, Dim, 1>& a, const Eigen::Matrix<double, Dim, 1>& b) {
  typename NurbsCurve<Dim>::Points points(Dim, 2);
  points.col(0) = a;
  points.col(1) = b;
  return {KnotVector(), std::move(points)};
}

Curve2 circular_arc(const Eigen::Vector2d& centre, double radius, double a, double b) {
  constexpr double pi = std::numbers::pi;
  if (!(radius > 0) || !std::isfinite(radius)) throw GeometryError("arc radius " + text(radius) + " must be positive");
  // A full turn made of rounded angles may exceed 2 pi by a little.
  if (!(a < b) || !(b - a <= 2 * pi * (1 + 1e-14) + 1e-15 * (std::abs(a) + std::abs(b))))
    throw GeometryError("arc from " + text(a) + " to " + text(b) + " rad must turn by more than 0, at most 2 pi");
  const int pieces = std::clamp(static_cast<int>(std::ceil((b - a) / (pi / 2) - 1e-12)), 1, 4);
  const double half = (b - a) / (2 * pieces);
  Curve2::Points points(2, 2 * pieces + 1);
  std::vector<double> weights(2 * pieces + 1, 1.0);
  std::vector<double> knots = {0, 0, 0};
  for (int i = 0; i <= 2 * pieces; ++i) {
    const double angle = i == 2 * pieces ? b : a + half * i;
    const bool corner = i % 2 == 1;
    points.col(i) =
        centre + (corner ? radius / std::cos(half) : radius) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    if (corner) weights[i] = std::cos(half);
  }
  for (int i = 1; i < pieces; ++i) knots.insert(knots.end(), 2, static_cast<double>(i) / pieces);
  knots.insert(knots.end(), 3, 1.0);
  if (b - a >= 2 * pi * (1 - 1e-15)) points.col(2 * pieces) = points.col(0);  // a full turn closes bitwise
  return {KnotVector(2, std::move(knots)), std::move(points), std::move(weights)};
}

Curve2 circular_arc_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double turn) {
  constexpr double pi = std::numbers::pi;
  if (!(std::abs(turn) > 0 && std::abs(turn) < 2 * pi && a != b))
    throw GeometryError("an arc that turns by " + text(turn) +
                        " rad must turn by more than 0, less than 2 pi, and its "
                        "ends must differ");
  const double half = std::abs(turn) / 2;  // angles are measured from the middle of the arc
  const int pieces = std::clamp(static_cast<int>(std::ceil(2 * half / (pi / 2) - 1e-12)), 1, 4);
  const double step = half / pieces;
  // In the chord's frame, in units of the chord: x along it, y to the side of the arc. Written so that flat arcs, whose
  // centre is far away, lose nothing: cos p - cos q = 2 sin((q + p) / 2) sin((q - p) / 2).
  const Eigen::Vector2d middle = a + (b - a) / 2, chord = b - a;
  const Eigen::Vector2d side = (turn > 0 ? 1.0 : -1.0) * Eigen::Vector2d(chord.y(), -chord.x());
  const double diameter = 2 * std::sin(half);  // in radii: the chord
  Curve2::Points points(2, 2 * pieces + 1);
  std::vector<double> weights(2 * pieces + 1, 1.0);
  std::vector<double> knots = {0, 0, 0};
  for (int i = 0; i <= 2 * pieces; ++i) {
    const double angle = step * (i - pieces);
    double x = std::sin(angle) / diameter;
    double y = 2 * std::sin((half + angle) / 2) * std::sin((half - angle) / 2) / diameter;
    if (i % 2 == 1) {
      // The tangents' meeting point lies (1 / cos(step) - 1) radii further out.
      const double out = 2 * std::sin(step / 2) * std::sin(step / 2) / std::cos(step) / diameter;
      x += out * std::sin(angle);
      y += out * std::cos(angle);
      weights[i] = std::cos(step);
    }
    points.col(i) = middle + x * chord + y * side;
  }
  points.col(0) = a;
  points.col(2 * pieces) = b;
  for (int i = 1; i < pieces; ++i) knots.insert(knots.end(), 2, static_cast<double>(i) / pieces);
  knots.insert(knots.end(), 3, 1.0);
  return {KnotVector(2, std::move(knots)), std::move(points), std::move(weights)};
}

namespace {

// Adaptive bisection of the eight-point rule. A depth of 40 meets only at a cusp, where the rest contributes nothing.
template <class Function>
double integrate(const Function& f, double a, double b, double whole, double tolerance, int depth) {
  const double middle = a + (b - a) / 2;
  const double left = gauss8(f, a, middle), right = gauss8(f, middle, b);
  if (std::abs(left + right - whole) <= tolerance || depth >= 40) return left + right;
  return integrate(f, a, middle, left, tolerance / 2, depth + 1) +
         integrate(f, middle, b, right, tolerance / 2, depth + 1);
}

}  // namespace

template <int Dim>
double arc_length(const NurbsCurve<Dim>& curve, Interval range, double relative_tolerance) {
  const auto speed = [&](double t) { return evaluate(curve, t).d1.norm(); };
  std::vector<double> ends = {range.min};
  for (double b : curve.knots().breaks())
    if (range.min < b && b < range.max) ends.push_back(b);
  ends.push_back(range.max);
  const std::size_t pieces = ends.size() - 1;
  std::vector<double> first(pieces);
  double estimate = 0;
  for (std::size_t i = 0; i < pieces; ++i) estimate += first[i] = gauss8(speed, ends[i], ends[i + 1]);
  const double tolerance = std::max(relative_tolerance, 1e-15) * std::abs(estimate) / static_cast<double>(pieces);
  double length = 0;
  for (std::size_t i = 0; i < pieces; ++i) length += integrate(speed, ends[i], ends[i + 1], first[i], tolerance, 0);
  return length;
}

template class NurbsCurve<2>;
template class NurbsCurve<3>;
template CurveJet<2> evaluate(const NurbsCurve<2>&, double);
template CurveJet<3> evaluate(const NurbsCurve<3>&, double);
template CurveJet<2> evaluate_on_span(const NurbsCurve<2>&, int, double);
template CurveJet<3> evaluate_on_span(const NurbsCurve<3>&, int, double);
template NurbsCurve<2> line_segment(const Eigen::Matrix<double, 2, 1>&, const Eigen::Matrix<double, 2, 1>&);
template NurbsCurve<3> line_segment(const Eigen::Matrix<double, 3, 1>&, const Eigen::Matrix<double, 3, 1>&);
template double arc_length(const NurbsCurve<2>&, Interval, double);
template double arc_length(const NurbsCurve<3>&, Interval, double);

}  // namespace toile
