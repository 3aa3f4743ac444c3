// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/shell/kink_kernel.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "analysis/shell/material_basis.h"

namespace toile {
namespace {

// A number with its derivative along dq.
struct Dual {
  double value = 0, slope = 0;
};
inline Dual operator+(Dual a, Dual b) {
  return {a.value + b.value, a.slope + b.slope};
}
inline Dual operator-(Dual a, Dual b) {
  return {a.value - b.value, a.slope - b.slope};
}
inline Dual operator*(Dual a, Dual b) {
  return {a.value * b.value, a.slope * b.value + a.value * b.slope};
}
inline Dual operator/(Dual a, Dual b) {
  const double q = a.value / b.value;
  return {q, (a.slope - q * b.slope) / b.value};
}
using toile::sqrt;
inline Dual sqrt(Dual a) {
  const double r = std::sqrt(a.value);
  return {r, 0.5 * a.slope / r};
}

template <class Real>
struct Hinge {
  Vec3<Real> a, before, after;
};

double angle(const Hinge<double>& x) {
  const Vec3<double> m = cross(x.before, x.a), n = cross(x.after, x.a);
  return std::atan2(dot(x.a, cross(m, n)) / std::sqrt(dot(x.a, x.a)), dot(m, n));
}

// Gradient of the angle. A wing turns by -n . dw / h, h its height over the line; along a the gradient follows from
// invariance under rotations and under stretching a.
template <class Real>
Hinge<Real> angle_gradient(const Hinge<Real>& x) {
  const Vec3<Real> m = cross(x.before, x.a), n = cross(x.after, x.a);
  const Real aa = dot(x.a, x.a), length = sqrt(aa);
  Hinge<Real> g;
  g.before = (length / dot(m, m)) * m;
  const Vec3<Real> after = (length / dot(n, n)) * n;
  g.a = (dot(x.a, x.after) / aa) * after - (dot(x.a, x.before) / aa) * g.before;
  g.after = Vec3<Real>{} - after;
  return g;
}

Hinge<double> interpolate(const KinkStrip& strip, const double* q) {
  Hinge<double> x{};
  for (std::size_t k = 0; k < strip.index.size(); ++k) {
    const double* p = q + 3 * static_cast<std::ptrdiff_t>(strip.index[k]);
    const Vec3<double> point{p[0], p[1], p[2]};
    x.a = x.a + strip.along[k] * point;
    x.before = x.before + strip.before[k] * point;
    x.after = x.after + strip.after[k] * point;
  }
  return x;
}

void subtract(const KinkStrip& strip, double scale, const Hinge<double>& g, double* out) {
  for (std::size_t k = 0; k < strip.index.size(); ++k) {
    const Vec3<double> f = scale * (strip.along[k] * g.a + strip.before[k] * g.before + strip.after[k] * g.after);
    double* p = out + 3 * static_cast<std::ptrdiff_t>(strip.index[k]);
    p[0] -= f.x;
    p[1] -= f.y;
    p[2] -= f.z;
  }
}

// Energy, moment and slope per length of line.
BendingTerms<double> response(const KinkStrip& strip, const PointLaw& law, double theta) {
  const double turn = std::remainder(theta - strip.rest_angle, 2 * std::numbers::pi), kappa = turn / strip.width;
  BendingTerms<double> sum{0, 0, 0};
  if (law.weft_warp_bending)
    for (const double part : {strip.weft, strip.warp}) {
      const BendingTerms<double> terms = evaluate(law.bending, part * kappa);
      sum.energy += strip.width * terms.energy;
      sum.moment += part * terms.moment;
      sum.slope += part * part * terms.slope / strip.width;
    }
  const double k12 = strip.twist * kappa;
  sum.energy += strip.width * law.twist * k12 * k12;
  sum.moment += 2 * law.twist * strip.twist * k12;
  sum.slope += 2 * law.twist * strip.twist * strip.twist / strip.width;
  return sum;
}

}  // namespace

KinkStrip make_kink_strip(const ClothPanel& panel, int panel_number, int first_control_point, const KinkPoint& point) {
  const bool is_u = point.direction == Direction::u;
  const NurbsSurface& rest = panel.rest;
  const KnotVector& across = rest.knots(point.direction);
  const KnotVector& along = rest.knots(is_u ? Direction::v : Direction::u);
  const std::vector<int> spans = across.spans(), spans_along = along.spans();
  const auto after = std::ranges::find(spans, across.find_span(point.at));
  const int span_along = along.find_span(point.along);
  struct Side {
    int span;
    double at;
  };
  const bool seam = after == spans.begin();
  const Side before_line{seam ? spans.back() : *(after - 1), seam ? across.domain().max : point.at};
  const Side after_line{*after, point.at};

  KinkStrip strip;
  strip.panel = panel_number;
  const int cell_across = static_cast<int>(after - spans.begin());
  const int cell_along = static_cast<int>(std::ranges::find(spans_along, span_along) - spans_along.begin());
  strip.cell_i = is_u ? cell_across : cell_along;
  strip.cell_j = is_u ? cell_along : cell_across;

  std::map<int, std::array<double, 3>> rows;
  double narrower = 0;
  for (const Side* side : {&before_line, &after_line}) {
    const int span = side->span;
    const bool is_after = side == &after_line;
    MaterialBasis basis;
    evaluate_material_basis(panel, is_u ? span : span_along, is_u ? span_along : span, is_u ? side->at : point.along,
                            is_u ? point.along : side->at, basis);
    const Eigen::Matrix2d J = basis.chain.inverse();  // d(X1, X2) / d(u, v)
    const Eigen::Vector2d line = J.col(is_u ? 1 : 0), away = J.col(is_u ? 0 : 1), t = line.normalized();
    Eigen::Vector2d n(t.y(), -t.x());
    if (n.dot(away) < 0) n = -n;
    const double cell = n.dot(away) * (across[span + 1] - across[span]);
    narrower = is_after ? std::min(narrower, cell) : cell;
    strip.length = point.weight * line.norm();
    strip.weft = n.x() * n.x();
    strip.warp = n.y() * n.y();
    strip.twist = n.x() * n.y();
    for (int b = 0; b < basis.count_v; ++b)
      for (int a = 0; a < basis.count_u; ++a) {
        const int k = a + basis.count_u * b;
        const double d1 = basis.value[1][k], d2 = basis.value[2][k];
        auto& row = rows[first_control_point + rest.index(basis.first_u + a, basis.first_v + b)];
        if (is_after) row[0] = t.x() * d1 + t.y() * d2;
        row[is_after ? 2 : 1] = n.x() * d1 + n.y() * d2;
      }
  }
  strip.width = strip_width * narrower;
  for (const auto& [index, row] : rows) {
    const double size = std::max({std::abs(row[0]), std::abs(row[1]), std::abs(row[2])});
    if (size * narrower < 1e-12) continue;
    strip.index.push_back(index);
    strip.along.push_back(row[0]);
    strip.before.push_back(row[1]);
    strip.after.push_back(row[2]);
  }
  if (panel.fabric.rest_curvature == RestCurvature::panel) {
    // Rows are numbered over all panels, the net over this one.
    strip.rest_angle =
        angle(interpolate(strip, rest.points().data() - 3 * static_cast<std::ptrdiff_t>(first_control_point)));
  }
  return strip;
}

double add_kink_force(const KinkStrip& strip, const PointLaw& law, const double* q, double* force) {
  const Hinge<double> x = interpolate(strip, q);
  const BendingTerms<double> terms = response(strip, law, angle(x));
  subtract(strip, strip.length * terms.moment, angle_gradient(x), force);
  return strip.length * terms.energy;
}

double add_kink_tangent(const KinkStrip& strip, const PointLaw& law, const double* q, const double* dq,
                        double* minus_df) {
  const Hinge<double> x = interpolate(strip, q), dx = interpolate(strip, dq);
  const BendingTerms<double> terms = response(strip, law, angle(x));
  const auto dual = [](const Vec3<double>& value, const Vec3<double>& slope) {
    return Vec3<Dual>{{value.x, slope.x}, {value.y, slope.y}, {value.z, slope.z}};
  };
  const Hinge<Dual> g = angle_gradient<Dual>({dual(x.a, dx.a), dual(x.before, dx.before), dual(x.after, dx.after)});
  const Hinge<double> g0 = angle_gradient(x);
  const double turn = dot(g0.a, dx.a) + dot(g0.before, dx.before) + dot(g0.after, dx.after);
  const auto second = [&](const Vec3<Dual>& gradient, const Vec3<double>& first) {
    return terms.slope * turn * first +
           terms.moment * Vec3<double>{gradient.x.slope, gradient.y.slope, gradient.z.slope};
  };
  const Hinge<double> dg{second(g.a, g0.a), second(g.before, g0.before), second(g.after, g0.after)};
  if (minus_df != nullptr) subtract(strip, strip.length, dg, minus_df);
  return strip.length * (dot(dx.a, dg.a) + dot(dx.before, dg.before) + dot(dx.after, dg.after));
}

KinkHessian kink_hessian(const KinkStrip& strip, const PointLaw& law, const double* q, TangentKind kind) {
  const Hinge<double> x = interpolate(strip, q), g = angle_gradient(x);
  const BendingTerms<double> terms = response(strip, law, angle(x));
  Eigen::Matrix<double, 9, 1> gradient;
  gradient << g.a.x, g.a.y, g.a.z, g.before.x, g.before.y, g.before.z, g.after.x, g.after.y, g.after.z;
  KinkHessian hessian = strip.length * terms.slope * gradient * gradient.transpose();
  if (kind == TangentKind::positive) return hessian;
  for (int k = 0; k < 9; ++k) {
    std::array<Dual, 9> along{
        {{x.a.x}, {x.a.y}, {x.a.z}, {x.before.x}, {x.before.y}, {x.before.z}, {x.after.x}, {x.after.y}, {x.after.z}}};
    along[static_cast<std::size_t>(k)].slope = 1;
    const Hinge<Dual> turned = angle_gradient<Dual>(
        {{along[0], along[1], along[2]}, {along[3], along[4], along[5]}, {along[6], along[7], along[8]}});
    int row = 0;
    for (const Vec3<Dual>* part : {&turned.a, &turned.before, &turned.after})
      for (const Dual* number : {&part->x, &part->y, &part->z})
        hessian(row++, k) += strip.length * terms.moment * number->slope;
  }
  return hessian;
}

Eigen::Matrix3d kink_block(const KinkStrip& strip, const KinkHessian& hessian, std::size_t i, std::size_t j) {
  const std::array<double, 3> of_i{strip.along[i], strip.before[i], strip.after[i]},
      of_j{strip.along[j], strip.before[j], strip.after[j]};
  Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s)
      block +=
          of_i[static_cast<std::size_t>(r)] * of_j[static_cast<std::size_t>(s)] * hessian.block<3, 3>(3 * r, 3 * s);
  return block;
}

}  // namespace toile
