// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/fit.h"

#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "geometry/error.h"
#include "geometry/text.h"

namespace toile {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using RowSparse = Eigen::SparseMatrix<double, Eigen::RowMajor>;
using Triplets = std::vector<Eigen::Triplet<double>>;

void check(const NurbsSurface& surface, std::span<const FitSample> samples) {
  Eigen::Vector2d mean(0, 0);
  const Interval du = surface.u().domain(), dv = surface.v().domain();
  const auto scaled = [&](const FitSample& s) {
    return Eigen::Vector2d((s.u - du.min) / du.length(), (s.v - dv.min) / dv.length());
  };
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const FitSample& s = samples[k];
    const std::string who = "sample " + std::to_string(k);
    if (!s.x.allFinite()) throw GeometryError(who + ": its place isn't finite");
    if (!du.contains(s.u) || !dv.contains(s.v))
      throw GeometryError(who + ": (u, v) = (" + text(s.u) + ", " + text(s.v) + ") lies outside the domain");
    if (!(s.weight > 0) || !std::isfinite(s.weight))
      throw GeometryError(who + ": weight is " + text(s.weight) + ", must be positive");
    mean += scaled(s) / static_cast<double>(samples.size());
  }
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const FitSample& s : samples) spread += (scaled(s) - mean) * (scaled(s) - mean).transpose();
  // Second moments in units of the domain: samples within 1e-8 of a line are on it.
  if (!(spread.determinant() > 1e-16 * spread.trace() * spread.trace()))
    throw GeometryError(std::to_string(samples.size()) +
                        " samples on one line of the parameter plane determine no net");
}

// Rows: differences of slopes along u and v times the mean of both steps, and differences of opposite differences; all
// vanish for affine functions of the Greville abscissae.
RowSparse second_differences(const NurbsSurface& surface) {
  Triplets entries;
  int row = 0;
  const auto along = [&](const KnotVector& knots, int count, const auto& index) {
    for (int i = 1; i + 1 < count; ++i) {
      const double a = knots.greville(i) - knots.greville(i - 1), b = knots.greville(i + 1) - knots.greville(i);
      if (!(a > 0 && b > 0)) continue;
      const double h = (a + b) / 2;
      entries.emplace_back(row, index(i - 1), h / a);
      entries.emplace_back(row, index(i), -h / a - h / b);
      entries.emplace_back(row++, index(i + 1), h / b);
    }
  };
  for (int j = 0; j < surface.count_v(); ++j)
    along(surface.u(), surface.count_u(), [&](int i) { return surface.index(i, j); });
  for (int i = 0; i < surface.count_u(); ++i)
    along(surface.v(), surface.count_v(), [&](int j) { return surface.index(i, j); });
  for (int j = 0; j + 1 < surface.count_v(); ++j)
    for (int i = 0; i + 1 < surface.count_u(); ++i) {
      entries.emplace_back(row, surface.index(i, j), 1);
      entries.emplace_back(row, surface.index(i + 1, j), -1);
      entries.emplace_back(row, surface.index(i, j + 1), -1);
      entries.emplace_back(row++, surface.index(i + 1, j + 1), 1);
    }
  RowSparse rows(row, surface.points().cols());
  rows.setFromTriplets(entries.begin(), entries.end());
  return rows;
}

}  // namespace

NetFit fit_net(const NurbsSurface& surface, std::span<const FitSample> samples, const FitOptions& options) {
  check(surface, samples);
  const auto n = surface.points().cols(), m = static_cast<Eigen::Index>(samples.size());
  RowSparse values(m, n);
  Eigen::VectorXd weights(m);
  Eigen::MatrixX3d target(m, 3);
  {
    Triplets entries;
    SurfaceBasis basis;
    for (Eigen::Index k = 0; k < m; ++k) {
      const FitSample& s = samples[static_cast<std::size_t>(k)];
      evaluate_basis(surface, s.u, s.v, basis);
      for (int b = 0; b < basis.count_v; ++b)
        for (int a = 0; a < basis.count_u; ++a) {
          const double value = basis.value[0][static_cast<std::size_t>(a + basis.count_u * b)];
          if (value != 0)
            entries.emplace_back(static_cast<int>(k), surface.index(basis.first_u + a, basis.first_v + b), value);
        }
      weights[k] = s.weight;
      target.row(k) = s.x;
    }
    values.setFromTriplets(entries.begin(), entries.end());
  }
  weights /= weights.mean();

  const Sparse data = values.transpose() * weights.asDiagonal() * values;
  const RowSparse rows = second_differences(surface);
  const Sparse smooth = rows.transpose() * rows;
  const double share = options.smoothing * data.diagonal().sum() / std::max(smooth.diagonal().sum(), 1e-300);
  const Eigen::SimplicialLDLT<Sparse> factor(data + share * smooth);
  if (factor.info() != Eigen::Success) throw GeometryError("the samples determine no net");

  NetFit fit;
  for (Eigen::Index k = 0; k < n; ++k) fit.without_samples += data.coeff(k, k) == 0;
  Eigen::MatrixX3d net = surface.points().transpose();
  const auto squared = [&](const Eigen::MatrixX3d& left) { return weights.dot(left.rowwise().squaredNorm()); };
  Eigen::MatrixX3d left = target - values * net;
  double before = squared(left);
  // Residuals at the rounding of the places are none.
  const double rounding = 8 * std::numeric_limits<double>::epsilon() * target.cwiseAbs().maxCoeff();
  const double nothing = static_cast<double>(m) * rounding * rounding;
  for (; fit.rounds < options.rounds && before > nothing; ++fit.rounds) {
    const Eigen::MatrixX3d next = net + factor.solve(values.transpose() * (weights.asDiagonal() * left));
    const Eigen::MatrixX3d still = target - values * next;
    const double now = squared(still);
    if (!(now < before)) break;
    const bool settled = now > 0.98 * before;
    net = next;
    left = still;
    before = now;
    if (settled) break;
  }
  fit.surface = surface.with_points(net.transpose());
  fit.rms = std::sqrt(left.rowwise().squaredNorm().mean());
  Eigen::Index worst = 0;
  fit.largest = left.rowwise().norm().maxCoeff(&worst);
  fit.largest_at = {samples[static_cast<std::size_t>(worst)].u, samples[static_cast<std::size_t>(worst)].v};
  return fit;
}

}  // namespace toile
