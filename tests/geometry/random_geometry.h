// SPDX-License-Identifier: GPL-3.0-or-later
// Random knot vectors, curves and surfaces for law tests. Every test states its seed with SCOPED_TRACE, so that a
// failure prints it.
#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "geometry/nurbs_curve.h"
#include "geometry/nurbs_surface.h"

namespace toile::test {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double real(double a, double b) { return a + (b - a) * static_cast<double>(engine_()) / 4294967296.0; }
  int integer(int a, int b) { return a + static_cast<int>(engine_() % static_cast<unsigned>(b - a + 1)); }

 private:
  std::mt19937 engine_;
};

enum class Ends { clamped, unclamped };

// Uneven spans, interior multiplicities from 1 to `most` (0: the degree).
inline KnotVector random_knots(Random& random, int degree, int spans, Ends ends, int most = 0) {
  if (most == 0) most = std::max(degree, 1);
  std::vector<double> knots(degree + 1, random.real(-2, 2));
  for (int s = 1; s < spans; ++s)
    knots.insert(knots.end(), random.integer(1, most), knots.back() + random.real(0.2, 1.2));
  knots.insert(knots.end(), degree + 1, knots.back() + random.real(0.2, 1.2));
  if (ends == Ends::unclamped)
    for (int i = degree - 1, j = static_cast<int>(knots.size()) - degree; i >= 0; --i, ++j) {
      knots[i] = knots[i + 1] - std::max(0.0, random.real(-0.2, 0.8));
      knots[j] = knots[j - 1] + std::max(0.0, random.real(-0.2, 0.8));
    }
  return {degree, knots};
}

enum class Kind { polynomial, rational };

inline std::vector<double> random_weights(Random& random, int count, Kind kind) {
  std::vector<double> weights;
  if (kind == Kind::rational)
    for (int i = 0; i < count; ++i) weights.push_back(random.real(0.3, 3));
  return weights;
}

template <int Dim>
NurbsCurve<Dim> random_curve(Random& random, int degree, int spans, Ends ends, Kind kind, int most = 0) {
  KnotVector knots = random_knots(random, degree, spans, ends, most);
  const int n = knots.control_point_count();
  typename NurbsCurve<Dim>::Points points(Dim, n);
  for (int i = 0; i < n; ++i)
    for (int d = 0; d < Dim; ++d) points(d, i) = random.real(-1, 1) + (d == 0 ? i : 0);
  return {std::move(knots), std::move(points), random_weights(random, n, kind)};
}

inline NurbsSurface random_surface(Random& random, int pu, int pv, int spans, Ends ends, Kind kind, int most = 0) {
  KnotVector u = random_knots(random, pu, spans, ends, most), v = random_knots(random, pv, spans, ends, most);
  const int nu = u.control_point_count(), nv = v.control_point_count();
  Eigen::Matrix3Xd points(3, nu * nv);
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i)
      points.col(i + nu * j) << i + random.real(-0.3, 0.3), j + random.real(-0.3, 0.3), random.real(-1, 1);
  return {std::move(u), std::move(v), std::move(points), random_weights(random, nu * nv, kind)};
}

// Evenly spread parameters of an interval, its ends and all `extra` included.
inline std::vector<double> spread(Interval range, int count, const std::vector<double>& extra = {}) {
  std::vector<double> result = extra;
  for (int k = 0; k < count; ++k) result.push_back(range.min + range.length() * k / (count - 1));
  result.back() = range.max;
  return result;
}

// Largest distance between two curves (or surfaces) over the domain of the first.
template <int Dim>
double largest_distance(const NurbsCurve<Dim>& a, const NurbsCurve<Dim>& b) {
  double largest = 0;
  for (double t : spread(a.domain(), 301, a.knots().breaks())) largest = std::max(largest, (a(t) - b(t)).norm());
  return largest;
}
inline double largest_distance(const NurbsSurface& a, const NurbsSurface& b) {
  double largest = 0;
  for (double u : spread(a.u().domain(), 33, a.u().breaks()))
    for (double v : spread(a.v().domain(), 33, a.v().breaks())) largest = std::max(largest, (a(u, v) - b(u, v)).norm());
  return largest;
}

template <class Geometry>
double size_of(const Geometry& g) {
  return (g.points().rowwise().maxCoeff() - g.points().rowwise().minCoeff()).norm();
}

// An eighth of the unit sphere, z up, its pole at v = 1.
inline NurbsSurface sphere_octant() {
  const Eigen::Vector2d corner[] = {{1, 0}, {1, 1}, {0, 1}};
  const double w[] = {1, std::sqrt(0.5), 1};
  Eigen::Matrix3Xd points(3, 9);
  std::vector<double> weights;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) {
      points.col(i + 3 * j) << corner[j].x() * corner[i].x(), corner[j].x() * corner[i].y(), corner[j].y();
      weights.push_back(w[i] * w[j]);
    }
  const KnotVector knots(2, {0, 0, 0, 1, 1, 1});
  return {knots, knots, points, weights};
}

// A circular cylinder along z: full turn in u, height in v.
inline NurbsSurface cylinder(double radius, double height) {
  const Curve2 circle = circular_arc({0, 0}, radius, 0, 2 * std::acos(-1.0));
  const int n = circle.knots().control_point_count();
  Eigen::Matrix3Xd points(3, 2 * n);
  std::vector<double> weights;
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < n; ++i) {
      points.col(i + n * j) << circle.points().col(i), height * j;
      weights.push_back(circle.weight(i));
    }
  return {circle.knots(), KnotVector(1, {0, 0, 1, 1}), points, weights};
}

}  // namespace toile::test
