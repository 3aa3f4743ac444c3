// SPDX-License-Identifier: GPL-3.0-or-later
// Entities 112 (parametric spline curve) and 114 (parametric spline surface): polynomials in powers of the distance
// from each breakpoint, at most cubic. Bernstein form is exact. [IGES 5.3, 4.14, 4.15]
#include <algorithm>
#include <cmath>

#include "geometry/error.h"
#include "io/iges/entity.h"
#include "io/iges/splines.h"

namespace toile::iges {

PowerSpline read_power_spline(Parameters& in) {
  PowerSpline spline;
  spline.kind = in.integer("CTYPE");
  spline.continuity = in.integer("H");
  spline.dimension = in.integer("NDIM");
  const int n = in.integer("N");
  if (n < 1) in.fail("N is " + std::to_string(n) + ", must be positive");
  in.expect(static_cast<long long>(n) + 1 + 12LL * n, std::to_string(n) + " segments");
  for (int i = 0; i <= n; ++i) spline.breaks.push_back(in.real("breakpoint", i));
  for (int i = 0; i < n; ++i)
    if (!(spline.breaks[static_cast<std::size_t>(i)] < spline.breaks[static_cast<std::size_t>(i) + 1]))
      in.fail("breakpoint " + std::to_string(i + 1) + " does not lie beyond the one before it");
  require_spans(in, spline.breaks, "breakpoint");
  for (int i = 0; i < 12 * n; ++i) spline.coefficients.push_back(in.real("coefficient of segment", i / 12));
  // Values and derivatives at the end, which the last segment says as well.
  for (int i = 0; i < 12 && in.left() > 0; ++i) spline.terminal.push_back(in.real("terminal value"));
  return spline;
}

void write(const PowerSpline& spline, Record& out) {
  out.integer(spline.kind).integer(spline.continuity).integer(spline.dimension);
  out.integer(static_cast<long long>(spline.breaks.size()) - 1);
  for (const auto* numbers : {&spline.breaks, &spline.coefficients, &spline.terminal})
    for (const double x : *numbers) out.real(x);
}

namespace {

constexpr double negligible = 1e-6;  // of the size: what files with few digits leave between pieces
constexpr const char* or_what = " (the file's resolution, or 1e-6 of the size)";

// Rows of a 4 x n matrix hold the coefficients of 1, s, s^2, s^3 on [0, length]; the result holds the p + 1 Bernstein
// coefficients, p <= 3 being enough for what is there.
Eigen::MatrixXd bernstein(const Eigen::MatrixXd& powers, double length, int p) {
  Eigen::MatrixXd scaled = powers.topRows(p + 1);
  double factor = 1;
  for (int k = 1; k <= p; ++k) scaled.row(k) *= factor *= length;
  const auto choose = [](int n, int k) {
    double c = 1;
    for (int i = 0; i < k; ++i) c = c * (n - i) / (i + 1);
    return c;
  };
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(p + 1, powers.cols());
  for (int j = 0; j <= p; ++j)
    for (int k = 0; k <= j; ++k) out.row(j) += choose(j, k) / choose(p, k) * scaled.row(k);
  return out;
}

KnotVector piecewise_knots(int degree, const std::vector<double>& breaks) {
  std::vector<double> knots{breaks.front()};
  for (std::size_t i = 0; i < breaks.size(); ++i)
    knots.insert(knots.end(), static_cast<std::size_t>(degree), breaks[i]);
  knots.push_back(breaks.back());
  return KnotVector(degree, std::move(knots));
}

}  // namespace

JoinedCurve to_curve(const PowerSpline& spline, double tolerance) {
  const auto n = static_cast<Eigen::Index>(spline.breaks.size()) - 1;
  const Eigen::Map<const Eigen::Matrix<double, 4, Eigen::Dynamic>> powers(spline.coefficients.data(), 4, 3 * n);
  int degree = 3;
  while (degree > 1 && (powers.row(degree).array() == 0).all()) --degree;
  Eigen::Matrix3Xd points(3, degree * n + 1);
  double gap = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double length = spline.breaks[static_cast<std::size_t>(i) + 1] - spline.breaks[static_cast<std::size_t>(i)];
    const Eigen::MatrixXd piece = bernstein(powers.middleCols(3 * i, 3), length, degree).transpose();
    if (i > 0) {
      const double jump = (piece.col(0) - points.col(degree * i)).norm();
      const double size = powers.row(0).cwiseAbs().maxCoeff() + piece.cwiseAbs().maxCoeff();
      if (const double allowed = std::max(tolerance, negligible * size); jump > allowed)
        throw GeometryError("the spline jumps by " + format_real(jump) + " at breakpoint " + std::to_string(i) +
                            ", must be at most " + format_real(allowed) + or_what);
      gap = std::max(gap, jump);
    }
    points.middleCols(degree * i, degree + 1) = piece;
  }
  return {Curve3(piecewise_knots(degree, spline.breaks), std::move(points)), gap};
}

PowerSurface read_power_surface(Parameters& in) {
  PowerSurface s;
  s.kind = in.integer("CTYPE");
  s.patch_kind = in.integer("PTYPE");
  const int m = in.integer("M"), n = in.integer("N");
  if (m < 1 || n < 1) in.fail("M, N are " + std::to_string(m) + ", " + std::to_string(n) + ", must be positive");
  const long long patches = static_cast<long long>(m) * n;
  const std::string claim = std::to_string(m) + " x " + std::to_string(n) + " patches";
  // What follows the last row and column of patches is of no use and often missing.
  const long long needed = static_cast<long long>(m) + n + 2 + 48 * (patches + m - 1);
  in.expect(m, claim);
  in.expect(n, claim);
  in.expect(needed, claim);
  for (auto [breaks, count] : {std::pair(&s.u, m), std::pair(&s.v, n)})
    for (int i = 0; i <= count; ++i) {
      breaks->push_back(in.real("breakpoint", i));
      if (i > 0 && !((*breaks)[static_cast<std::size_t>(i) - 1] < breaks->back()))
        in.fail("breakpoint " + std::to_string(i) + " does not lie beyond the one before it");
    }
  for (const auto* breaks : {&s.u, &s.v}) require_spans(in, *breaks, "breakpoint");
  const long long whole = 48LL * (m + 1) * (n + 1);
  const long long there = std::min<long long>(whole, in.left());
  for (long long i = 0; i < there; ++i)
    s.coefficients.push_back(in.real("coefficient of patch", static_cast<int>(i / 48)));
  return s;
}

void write(const PowerSurface& s, Record& out) {
  out.integer(s.kind).integer(s.patch_kind);
  out.integer(static_cast<long long>(s.u.size()) - 1).integer(static_cast<long long>(s.v.size()) - 1);
  for (const auto* numbers : {&s.u, &s.v, &s.coefficients})
    for (const double x : *numbers) out.real(x);
}

JoinedSurface to_surface(const PowerSurface& s, double tolerance) {
  const int m = static_cast<int>(s.u.size()) - 1, n = static_cast<int>(s.v.size()) - 1;
  // Patch (i, j): x, y, z, each 4 x 4 with powers of s down the columns and of t along the rows.
  const auto patch = [&](int i, int j, int axis) {
    return Eigen::Map<const Eigen::Matrix4d>(s.coefficients.data() +
                                             48 * (static_cast<std::ptrdiff_t>(i) * (n + 1) + j) + 16 * axis);
  };
  std::array<int, 2> degree{1, 1};
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < n; ++j)
      for (int axis = 0; axis < 3; ++axis)
        for (int k = 2; k < 4; ++k) {
          if ((patch(i, j, axis).row(k).array() != 0).any()) degree[0] = std::max(degree[0], k);
          if ((patch(i, j, axis).col(k).array() != 0).any()) degree[1] = std::max(degree[1], k);
        }
  const int p = degree[0], q = degree[1], count = p * m + 1;
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(count) * (q * n + 1));
  double gap = 0;
  for (int i = 0; i < m; ++i) {
    const double du = s.u[static_cast<std::size_t>(i) + 1] - s.u[static_cast<std::size_t>(i)];
    for (int j = 0; j < n; ++j) {
      const double dv = s.v[static_cast<std::size_t>(j) + 1] - s.v[static_cast<std::size_t>(j)];
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::MatrixXd half = bernstein(patch(i, j, axis), du, p).transpose();
        const Eigen::MatrixXd net = bernstein(half, dv, q);  // (q + 1) x (p + 1)
        for (int b = 0; b <= q; ++b)
          for (int a = 0; a <= p; ++a) {
            double& x = points(axis, p * i + a + count * (q * j + b));
            if ((a == 0 && i > 0) || (b == 0 && j > 0)) gap = std::max(gap, std::abs(x - net(b, a)));
            x = net(b, a);
          }
      }
    }
  }
  if (const double allowed = std::max(tolerance, negligible * points.cwiseAbs().maxCoeff()); gap > allowed)
    throw GeometryError("the patches of the spline surface leave a gap of " + format_real(gap) + ", must be at most " +
                        format_real(allowed) + or_what);
  return {NurbsSurface(piecewise_knots(p, s.u), piecewise_knots(q, s.v), std::move(points)), gap};
}

}  // namespace toile::iges
