// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/surface_fit.h"

#include <Eigen/Dense>
#include <algorithm>

#include "geometry/basis.h"
#include "geometry/error.h"

namespace toile {

namespace {

KnotVector fit_knots(const std::vector<FitBreak>& breaks, int parts) {
  std::vector<double> knots(4, breaks.front().at);
  for (std::size_t i = 0; i + 1 < breaks.size(); ++i) {
    const double a = breaks[i].at, b = breaks[i + 1].at;
    for (int k = 1; k < parts; ++k) knots.push_back(a + (b - a) * k / parts);
    const bool last = i + 2 == breaks.size();
    knots.insert(knots.end(), last ? 4 : static_cast<std::size_t>(3 - std::clamp(breaks[i + 1].continuity, 0, 2)), b);
  }
  return KnotVector(3, std::move(knots));
}

Eigen::MatrixXd collocation(const KnotVector& knots, const std::vector<double>& at) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(at.size()), knots.control_point_count());
  BasisValues basis;
  for (std::size_t i = 0; i < at.size(); ++i) {
    evaluate_basis(knots, at[i], 0, basis);
    for (int j = 0; j <= basis.degree; ++j) out(static_cast<Eigen::Index>(i), basis.first + j) = basis.value[0][j];
  }
  return out;
}

std::vector<double> greville(const KnotVector& knots) {
  std::vector<double> out;
  for (int i = 0; i < knots.control_point_count(); ++i)
    out.push_back(std::clamp(knots.greville(i), knots.domain().min, knots.domain().max));
  return out;
}

}  // namespace

SurfaceFit fit_surface(const std::function<Eigen::Vector3d(double, double)>& f, const std::vector<FitBreak>& u,
                       const std::vector<FitBreak>& v, double tolerance, int max_spans) {
  const auto spans = [](const std::vector<FitBreak>& breaks) { return static_cast<int>(breaks.size()) - 1; };
  for (int parts = 2;; parts *= 2) {
    const KnotVector ku = fit_knots(u, parts), kv = fit_knots(v, parts);
    const std::vector<double> gu = greville(ku), gv = greville(kv);
    const auto nu = static_cast<Eigen::Index>(gu.size()), nv = static_cast<Eigen::Index>(gv.size());
    const Eigen::PartialPivLU<Eigen::MatrixXd> solve_u(collocation(ku, gu)), solve_v(collocation(kv, gv));
    Eigen::Matrix3Xd points(3, nu * nv);
    std::array<Eigen::MatrixXd, 3> values;
    for (Eigen::MatrixXd& m : values) m.resize(nu, nv);
    for (Eigen::Index j = 0; j < nv; ++j)
      for (Eigen::Index i = 0; i < nu; ++i) {
        const Eigen::Vector3d x = f(gu[static_cast<std::size_t>(i)], gv[static_cast<std::size_t>(j)]);
        if (!x.allFinite()) throw GeometryError("the surface has no finite point at a parameter");
        for (int axis = 0; axis < 3; ++axis) values[static_cast<std::size_t>(axis)](i, j) = x[axis];
      }
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::MatrixXd along_u = solve_u.solve(values[static_cast<std::size_t>(axis)]);
      const Eigen::MatrixXd net = solve_v.solve(along_u.transpose()).transpose();
      points.row(axis) = net.reshaped().transpose();
    }
    SurfaceFit out{NurbsSurface(ku, kv, std::move(points)), 0};
    for (const int su : ku.spans())
      for (const int sv : kv.spans())
        for (const double a : {0.2, 0.5, 0.8, 1.0})
          for (const double b : {0.25, 0.6, 1.0}) {
            const double x = ku[su] + a * (ku[su + 1] - ku[su]), y = kv[sv] + b * (kv[sv + 1] - kv[sv]);
            out.error = std::max(out.error, (f(x, y) - out.surface(x, y)).norm());
          }
    if (out.error <= tolerance || 2 * parts * std::max(spans(u), spans(v)) > max_spans) return out;
  }
}

}  // namespace toile
