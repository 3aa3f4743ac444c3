// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/nurbs_surface.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "geometry/error.h"
#include "geometry/rational_jet.h"
#include "geometry/text.h"

namespace toile {
namespace {

std::string place(const KnotVector& u, std::size_t k) {
  const auto n = static_cast<std::size_t>(u.control_point_count());
  return std::to_string(k) + " (" + std::to_string(k % n) + ", " + std::to_string(k / n) + ")";
}

}  // namespace

NurbsSurface::NurbsSurface(KnotVector u, KnotVector v, Eigen::Matrix3Xd points, std::vector<double> weights)
    : knots_{std::move(u), std::move(v)}, points_(std::move(points)), weights_(std::move(weights)) {
  const std::size_t count = static_cast<std::size_t>(count_u()) * static_cast<std::size_t>(count_v());
  if (static_cast<std::size_t>(points_.cols()) != count)
    throw GeometryError("the knots need " + std::to_string(count_u()) + " x " + std::to_string(count_v()) +
                        " control points, there are " + std::to_string(points_.cols()));
  if (!weights_.empty() && weights_.size() != count)
    throw GeometryError("the knots need " + std::to_string(count_u()) + " x " + std::to_string(count_v()) +
                        " weights, there are " + std::to_string(weights_.size()));
  for (std::size_t k = 0; k < count; ++k)
    if (!points_.col(static_cast<Eigen::Index>(k)).allFinite())
      throw GeometryError("control point " + place(knots_[0], k) + " is not finite");
  for (std::size_t k = 0; k < weights_.size(); ++k)
    if (!(weights_[k] > 0 && std::isfinite(weights_[k])))
      throw GeometryError("weight " + place(knots_[0], k) + " is " + text(weights_[k]) +
                          ", must be positive and finite");
  rational_ = std::ranges::any_of(weights_, [&](double w) { return w != weights_.front(); });
}

NurbsSurface NurbsSurface::with_points(Eigen::Matrix3Xd points) const {
  return {knots_[0], knots_[1], std::move(points), weights_};
}

Eigen::Vector3d NurbsSurface::operator()(double u, double v) const {
  BasisValues bu, bv;
  evaluate_basis(knots_[0], u, 0, bu);
  evaluate_basis(knots_[1], v, 0, bv);
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  double w = 0;
  for (int b = 0; b <= bv.degree; ++b) {
    Eigen::Vector3d row = Eigen::Vector3d::Zero();
    double row_w = 0;
    for (int a = 0; a <= bu.degree; ++a) {
      const int k = index(bu.first + a, bv.first + b);
      const double c = bu.value[0][a] * (rational_ ? weight(k) : 1.0);
      row += c * points_.col(k);
      row_w += c;
    }
    x += bv.value[0][b] * row;
    w += bv.value[0][b] * row_w;
  }
  return rational_ ? Eigen::Vector3d(x / w) : x;
}

SurfaceJet evaluate(const NurbsSurface& surface, double u, double v) {
  return evaluate_on_span(surface, surface.u().find_span(u), surface.v().find_span(v), u, v);
}

SurfaceJet evaluate_on_span(const NurbsSurface& surface, int span_u, int span_v, double u, double v) {
  BasisValues bu, bv;
  evaluate_basis_on_span(surface.u(), span_u, u, 2, bu);
  evaluate_basis_on_span(surface.v(), span_v, v, 2, bv);
  detail::HomogeneousJet h;
  h.fill(Eigen::Vector4d::Zero());
  for (int b = 0; b <= bv.degree; ++b) {
    Eigen::Vector4d r0 = Eigen::Vector4d::Zero(), r1 = r0, r2 = r0;
    for (int a = 0; a <= bu.degree; ++a) {
      const Eigen::Vector4d point = detail::homogeneous_point(surface, surface.index(bu.first + a, bv.first + b));
      r0 += bu.value[0][a] * point;
      r1 += bu.value[1][a] * point;
      r2 += bu.value[2][a] * point;
    }
    h[0] += bv.value[0][b] * r0;
    h[1] += bv.value[0][b] * r1;
    h[2] += bv.value[1][b] * r0;
    h[3] += bv.value[0][b] * r2;
    h[4] += bv.value[1][b] * r1;
    h[5] += bv.value[2][b] * r0;
  }
  return detail::to_jet(h, surface.rational());
}

void evaluate_basis_on_span(const NurbsSurface& surface, int span_u, int span_v, double u, double v,
                            SurfaceBasis& out) {
  const int pu = surface.u().degree(), pv = surface.v().degree();
  if (pu > 7 || pv > 7)
    throw GeometryError("degrees " + std::to_string(pu) + " x " + std::to_string(pv) +
                        " are above 7, the most that surface functions are evaluated at");
  BasisValues bu, bv;
  evaluate_basis_on_span(surface.u(), span_u, u, 2, bu);
  evaluate_basis_on_span(surface.v(), span_v, v, 2, bv);
  out.first_u = bu.first;
  out.first_v = bv.first;
  out.count_u = pu + 1;
  out.count_v = pv + 1;
  auto& r = out.value;
  int k = 0;
  for (int b = 0; b <= pv; ++b)
    for (int a = 0; a <= pu; ++a, ++k) {
      r[0][k] = bu.value[0][a] * bv.value[0][b];
      r[1][k] = bu.value[1][a] * bv.value[0][b];
      r[2][k] = bu.value[0][a] * bv.value[1][b];
      r[3][k] = bu.value[2][a] * bv.value[0][b];
      r[4][k] = bu.value[1][a] * bv.value[1][b];
      r[5][k] = bu.value[0][a] * bv.value[2][b];
    }
  if (!surface.rational()) return;
  std::array<double, 6> w{};
  k = 0;
  for (int b = 0; b <= pv; ++b)
    for (int a = 0; a <= pu; ++a, ++k) {
      const double weight = surface.weight(surface.index(bu.first + a, bv.first + b));
      for (int row = 0; row < 6; ++row) w[row] += r[row][k] *= weight;
    }
  const double scale = 1 / w[0];
  for (k = 0; k < out.size(); ++k) {
    r[0][k] *= scale;
    r[1][k] = (r[1][k] - w[1] * r[0][k]) * scale;
    r[2][k] = (r[2][k] - w[2] * r[0][k]) * scale;
    r[3][k] = (r[3][k] - 2 * w[1] * r[1][k] - w[3] * r[0][k]) * scale;
    r[4][k] = (r[4][k] - w[1] * r[2][k] - w[2] * r[1][k] - w[4] * r[0][k]) * scale;
    r[5][k] = (r[5][k] - 2 * w[2] * r[2][k] - w[5] * r[0][k]) * scale;
  }
}

void evaluate_basis(const NurbsSurface& surface, double u, double v, SurfaceBasis& out) {
  evaluate_basis_on_span(surface, surface.u().find_span(u), surface.v().find_span(v), u, v, out);
}

}  // namespace toile
