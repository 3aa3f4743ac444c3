// SPDX-License-Identifier: GPL-3.0-or-later
// Entity 104, conic arc. [IGES 5.3, 4.5]
#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "geometry/error.h"
#include "io/iges/entity.h"

namespace toile::iges {

Conic read_conic(Parameters& in) {
  Conic conic;
  for (double& c : conic.coefficients) c = in.real("coefficient of the conic");
  conic.height = in.real("ZT");
  for (Eigen::Vector2d* point : {&conic.start, &conic.end})
    for (int axis = 0; axis < 2; ++axis) (*point)[axis] = in.real("coordinate of the conic");
  return conic;
}

void write(const Conic& conic, Record& out) {
  for (const double c : conic.coefficients) out.real(c);
  out.real(conic.height);
  for (const Eigen::Vector2d& point : {conic.start, conic.end}) out.real(point.x()).real(point.y());
}

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Curve3 lifted(const Conic& conic, const KnotVector& knots, const Eigen::Matrix2Xd& flat, std::vector<double> weights) {
  Eigen::Matrix3Xd points(3, flat.cols());
  points.topRows<2>() = flat;
  // The ends are the file's own numbers.
  points.col(0).head<2>() = conic.start;
  points.col(points.cols() - 1).head<2>() = conic.end;
  points.row(2).setConstant(conic.height);
  return Curve3(knots, std::move(points), std::move(weights));
}

void check_end(const Vector2d& given, const Vector2d& found, double size) {
  if ((given - found).norm() > 1e-3 * size)
    throw GeometryError("an end of the conic, (" + format_real(given.x()) + ", " + format_real(given.y()) +
                        "), does not lie on it");
}

// The affine image of an arc of the unit circle, counter-clockwise from start to end.
Curve3 ellipse(const Conic& conic, const Eigen::Matrix2d& quadratic, const Vector2d& linear) {
  const Vector2d centre = -0.5 * quadratic.inverse() * linear;
  const double level = centre.dot(quadratic * centre) - conic.coefficients[5];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(quadratic);
  const Vector2d squares = level * axes.eigenvalues().cwiseInverse();
  if (!(squares.minCoeff() > 0)) throw GeometryError("the ellipse has no points");
  Eigen::Matrix2d map = axes.eigenvectors() * squares.cwiseSqrt().asDiagonal();
  if (map.determinant() < 0) map.col(1) *= -1;
  const Eigen::Matrix2d inverse = map.inverse();
  const Vector2d a = inverse * (conic.start - centre), b = inverse * (conic.end - centre);
  check_end(conic.start, centre + map * a.normalized(), squares.cwiseSqrt().maxCoeff());
  check_end(conic.end, centre + map * b.normalized(), squares.cwiseSqrt().maxCoeff());
  const double from = std::atan2(a.y(), a.x());
  double to = std::atan2(b.y(), b.x());
  if (conic.start == conic.end) {
    to = from + 2 * std::numbers::pi;
  } else if (to <= from) {
    to += 2 * std::numbers::pi;
  }
  const Curve2 arc = circular_arc({0, 0}, 1, from, to);
  return lifted(conic, arc.knots(), (map * arc.points()).colwise() + centre, arc.weights());
}

}  // namespace

// Hyperbola and parabola are one rational quadratic: its middle point is the pole of the chord, and the conic's own
// form q gives its weight, w^2 = -q(M, M) / q(P, P) with M the middle of the chord and P the pole.
Curve3 to_curve(const Conic& conic) {
  const auto& [a, b, c, d, e, f] = conic.coefficients;
  Eigen::Matrix2d quadratic;
  quadratic << a, b / 2, b / 2, c;
  const Vector2d linear(d, e);
  const double size = quadratic.norm();
  if (!(size > 0)) throw GeometryError("the conic has no quadratic terms");
  const double determinant = quadratic.determinant();
  if (determinant > 1e-12 * size * size) return ellipse(conic, quadratic, linear);

  Eigen::Matrix3d q;
  q << a, b / 2, d / 2, b / 2, c, e / 2, d / 2, e / 2, f;
  if (conic.start == conic.end) throw GeometryError("the conic's ends coincide, and it is no ellipse");
  const auto tangent = [&](const Vector2d& x) { return Vector3d(q * x.homogeneous()); };
  for (const Vector2d& x : {conic.start, conic.end}) {
    const double slope = tangent(x).head<2>().norm();
    if (!(slope > 0)) throw GeometryError("the conic is degenerate");
    const double off = std::abs(x.homogeneous().dot(q * x.homogeneous())) / (2 * slope);
    if (off > 1e-3 * (conic.end - conic.start).norm())
      throw GeometryError("an end of the conic, (" + format_real(x.x()) + ", " + format_real(x.y()) +
                          "), does not lie on it");
  }
  const Vector3d meeting = tangent(conic.start).cross(tangent(conic.end));
  const Vector2d pole = meeting.hnormalized(), middle = 0.5 * (conic.start + conic.end);
  const bool parabola = std::abs(determinant) <= 1e-12 * size * size;
  const double ratio =
      -middle.homogeneous().dot(q * middle.homogeneous()) / pole.homogeneous().dot(q * pole.homogeneous());
  if (!pole.allFinite() || !(parabola || (ratio > 0 && std::isfinite(ratio))))
    throw GeometryError("the conic's ends lie on no common branch");
  Eigen::Matrix2Xd points(2, 3);
  points << conic.start, pole, conic.end;
  std::vector<double> weights;
  if (!parabola) weights = {1, std::sqrt(ratio), 1};
  return lifted(conic, KnotVector(2, {0, 0, 0, 1, 1, 1}), points, std::move(weights));
}

}  // namespace toile::iges
