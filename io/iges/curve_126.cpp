// SPDX-License-Identifier: GPL-3.0-or-later
// Entity 126, rational B-spline curve. [IGES 5.3, 4.23]
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "io/iges/entity.h"
#include "io/iges/splines.h"
#include "io/limits.h"

namespace toile::iges {

std::vector<double> read_knots(Parameters& in, int count) {
  std::vector<double> knots(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) knots[static_cast<std::size_t>(i)] = in.real("knot", i);
  require_spans(in, knots, "knot");
  return knots;
}

void require_spans(const Parameters& in, const std::vector<double>& breaks, const char* what) {
  constexpr double rounding = 1e-13;  // of numbers with all the digits of a double, some hundred steps
  const auto [least, most] = std::ranges::minmax(breaks);
  const double size = std::max(std::abs(least), std::abs(most));
  if (most > least && most - least < rounding * size)
    in.fail(std::string(what) + "s run from " + format_real(least) + " to " + format_real(most) +
            ", too near to each other for their size: export it with parameters from 0");
  for (std::size_t i = 1; i < breaks.size(); ++i)
    if (const double span = breaks[i] - breaks[i - 1]; span > 0 && span < smallest_span)
      in.fail(std::string(what) + "s " + std::to_string(i - 1) + " and " + std::to_string(i) + " are " +
              format_real(span) +
              " apart, must be equal or at least 1e-25 apart: export it with parameters from 0 to 1");
}

std::vector<double> read_weights(Parameters& in, int count) {
  std::vector<double> weights(static_cast<std::size_t>(count));
  bool all_one = true;
  for (int i = 0; i < count; ++i) {
    const double w = in.real("weight", i, 1);
    if (!(w > 0)) in.fail("weight " + std::to_string(i) + " is " + format_real(w) + ", must be positive");
    all_one = all_one && w == 1;
    weights[static_cast<std::size_t>(i)] = w;
  }
  const auto [least, most] = std::ranges::minmax(weights);
  if (most > largest_weight_ratio * least)
    in.fail("weights run from " + format_real(least) + " to " + format_real(most) +
            ", must be within a factor of 1e15: points of so little weight have no effect");
  if (all_one) weights.clear();
  return weights;
}

Interval read_range(Parameters& in, const char* what, const KnotVector& knots) {
  constexpr double same = 1e-9;
  const Interval domain = knots.domain();
  // Parameters end early where properties follow at once: a missing range is the domain.
  const bool stated = in.left() >= 2 && !in.defaulted();
  Interval range{in.real(what, 0, domain.min), in.real(what, 1, domain.max)};
  if (!stated) return domain;
  if (std::abs(range.min - domain.min) <= same * domain.length()) range.min = domain.min;
  if (std::abs(range.max - domain.max) <= same * domain.length()) range.max = domain.max;
  if (range.min >= domain.min && range.max <= domain.max && range.length() > same * domain.length()) return range;
  in.note(std::string("range ") + what, std::string(what) + " range " + format_real(range.min) + " to " +
                                            format_real(range.max) + " is no part of the domain " +
                                            format_real(domain.min) + " to " + format_real(domain.max) +
                                            "; the domain is taken");
  return domain;
}

SplineCurve read_spline_curve(Parameters& in) {
  const int k = in.integer("K");
  const int degree = in.integer("M");
  for (int i = 0; i < 4; ++i) in.integer("PROP");
  if (degree < 1 || degree > max_degree)
    in.fail("degree is " + std::to_string(degree) + ", must be 1 to " + std::to_string(max_degree));
  if (k < degree) in.fail("K is " + std::to_string(k) + ", must be at least the degree " + std::to_string(degree));
  const long long n = static_cast<long long>(k) + 1;
  in.expect(n + degree + 1 + 4 * n, std::to_string(n) + " control points of degree " + std::to_string(degree));
  const int count = k + 1;
  std::vector<double> knots = read_knots(in, count + degree + 1);
  std::vector<double> weights = read_weights(in, count);
  Eigen::Matrix3Xd points(3, count);
  for (int i = 0; i < count; ++i)
    for (int axis = 0; axis < 3; ++axis) points(axis, i) = in.real("coordinate of control point", i);
  const std::vector<int> dropped = drop_surplus(degree, knots, [&](int a, int b) {
    return points.col(a) == points.col(b) &&
           (weights.empty() || weights[static_cast<std::size_t>(a)] == weights[static_cast<std::size_t>(b)]);
  });
  if (!dropped.empty()) {
    in.note("surplus knots 126", "a knot occurs more often than the degree; " + std::to_string(dropped.size()) +
                                     " control points that it makes idle are left out");
    for (auto i = dropped.rbegin(); i != dropped.rend(); ++i) {
      const Eigen::Index rest = points.cols() - 1 - *i;
      points.middleCols(*i, rest) = points.rightCols(rest).eval();
      points.conservativeResize(3, points.cols() - 1);
      if (!weights.empty()) weights.erase(weights.begin() + *i);
    }
    if (std::all_of(weights.begin(), weights.end(), [](double w) { return w == 1; })) weights.clear();
  }
  try {
    SplineCurve out;
    out.curve = Curve3(KnotVector(degree, std::move(knots)), std::move(points), std::move(weights));
    out.range = read_range(in, "parameter", out.curve.knots());
    for (int i = 0; i < 3; ++i) in.real("normal");
    return out;
  } catch (const GeometryError& error) {
    in.fail(error.what());
  }
}

namespace {

// The unit normal of the plane that holds all points within 1e-12 of their extent: any for a line; nullopt for none.
std::optional<Eigen::Vector3d> plane_normal(const Eigen::Matrix3Xd& points) {
  const Eigen::Vector3d origin = points.col(0);
  const Eigen::Matrix3Xd relative = points.colwise() - origin;
  const double size = relative.colwise().norm().maxCoeff();
  const double tolerance = 1e-12 * std::max(size, points.cwiseAbs().maxCoeff());
  if (relative.row(2).cwiseAbs().maxCoeff() <= tolerance) return Eigen::Vector3d::UnitZ();
  int far = 0;
  relative.colwise().squaredNorm().maxCoeff(&far);
  const Eigen::Vector3d along = relative.col(far).normalized();
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < relative.cols(); ++i) {
    const Eigen::Vector3d normal = along.cross(relative.col(i));
    if (normal.squaredNorm() > best.squaredNorm()) best = normal;
  }
  const Eigen::Vector3d normal = best.norm() <= tolerance ? along.unitOrthogonal() : Eigen::Vector3d(best.normalized());
  if ((normal.transpose() * relative).cwiseAbs().maxCoeff() > tolerance) return std::nullopt;
  return normal;
}

}  // namespace

void write(const SplineCurve& spline, Record& out) {
  const Curve3& c = spline.curve;
  const int count = c.knots().control_point_count();
  const std::optional<Eigen::Vector3d> normal = plane_normal(c.points());
  const double size = (c.points().colwise() - Eigen::Vector3d(c.points().col(0))).colwise().norm().maxCoeff();
  const bool closed = (c(spline.range.min) - c(spline.range.max)).norm() <= 1e-12 * size;
  out.integer(count - 1).integer(c.degree());
  out.integer(normal ? 1 : 0).integer(closed ? 1 : 0).integer(c.rational() ? 0 : 1).integer(0);
  for (double knot : c.knots().knots()) out.real(knot);
  for (int i = 0; i < count; ++i) out.real(c.weight(i));
  for (int i = 0; i < count; ++i)
    for (int axis = 0; axis < 3; ++axis) out.real(c.points()(axis, i));
  out.real(spline.range.min).real(spline.range.max);
  for (int axis = 0; axis < 3; ++axis) out.real(normal ? (*normal)[axis] : 0.0);
}

}  // namespace toile::iges
