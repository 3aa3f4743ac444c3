// SPDX-License-Identifier: GPL-3.0-or-later
// NURBS curves in the plane (parameter curves) and in space.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "geometry/knot_vector.h"

namespace toile {

// A B-spline curve of control points (Dim x n) and weights; an empty weight vector means that all are 1.
//   (1) points.cols() = knots.control_point_count();
//   (2) weights are positive and finite, points finite.
// Control points are Euclidean (not multiplied by their weight), as IGES stores them. Throws GeometryError.
template <int Dim>
class NurbsCurve {
 public:
  using Point = Eigen::Matrix<double, Dim, 1>;
  using Points = Eigen::Matrix<double, Dim, Eigen::Dynamic>;

  NurbsCurve() : NurbsCurve(KnotVector(), Points::Zero(Dim, 2)) {}
  NurbsCurve(KnotVector knots, Points points, std::vector<double> weights = {});

  const KnotVector& knots() const { return knots_; }
  int degree() const { return knots_.degree(); }
  Interval domain() const { return knots_.domain(); }
  const Points& points() const { return points_; }
  const std::vector<double>& weights() const { return weights_; }
  double weight(int i) const { return weights_.empty() ? 1.0 : weights_[static_cast<std::size_t>(i)]; }
  // False also where all weights are equal: the curve is polynomial.
  bool rational() const { return rational_; }

  Point operator()(double t) const;
  Point start() const { return (*this)(domain().min); }
  Point end() const { return (*this)(domain().max); }

  bool operator==(const NurbsCurve&) const = default;

 private:
  KnotVector knots_;
  Points points_;
  std::vector<double> weights_;
  bool rational_ = false;
};

using Curve2 = NurbsCurve<2>;
using Curve3 = NurbsCurve<3>;

// Position, first and second derivative.
template <int Dim>
struct CurveJet {
  Eigen::Matrix<double, Dim, 1> x, d1, d2;
};
template <int Dim>
CurveJet<Dim> evaluate(const NurbsCurve<Dim>& curve, double t);
// The same of the piece on the named span (knot index), continued where t lies outside: one-sided derivatives at knots.
template <int Dim>
CurveJet<Dim> evaluate_on_span(const NurbsCurve<Dim>& curve, int span, double t);

template <int Dim>
NurbsCurve<Dim> line_segment(const Eigen::Matrix<double, Dim, 1>& a, const Eigen::Matrix<double, Dim, 1>& b);

// Circular arc in the plane from angle a to angle b > a [rad], b - a <= 2 pi, quadratic rational, counter-clockwise.
Curve2 circular_arc(const Eigen::Vector2d& centre, double radius, double a, double b);

// Circular arc from a to b that turns by `turn` [rad], 0 < |turn| < 2 pi, positive counter-clockwise; quadratic
// rational, its ends bitwise a and b. Throws GeometryError for a turn out of range or a = b.
Curve2 circular_arc_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double turn);

// Arc length over [t0, t1], adaptively to the relative tolerance.
template <int Dim>
double arc_length(const NurbsCurve<Dim>& curve, Interval range, double relative_tolerance = 1e-10);

}  // namespace toile
