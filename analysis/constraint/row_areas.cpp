// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/constraint/row_areas.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace toile {
namespace {

constexpr double least_area = 1e-3;  // of the panel's mean

using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

template <class Row>
Matrix matrix_of(const std::vector<Row>& rows, int control_points, auto scalar_row) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const ScalarRow& row = scalar_row(rows[r]);
    for (std::size_t k = 0; k < row.index.size(); ++k)
      entries.emplace_back(static_cast<int>(r), row.index[k], row.value[k]);
  }
  Matrix out(static_cast<Eigen::Index>(rows.size()), control_points);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

// Integrals over the cloth of 1, N_,weft and N_,warp per control point: columns area share, weft, warp.
Eigen::MatrixX3d integrals(const Body& body) {
  Eigen::MatrixX3d sum = Eigen::MatrixX3d::Zero(body.point_count(), 3);
  for (std::size_t k = 0; k < body.panels().size(); ++k) {
    const ClothPanel& panel = body.panels()[k];
    for (std::size_t p = 0; p < panel.quadrature.points.size(); ++p) {
      const Eigen::Vector2d& uv = panel.quadrature.points[p];
      const SurfaceJet jet = evaluate(panel.rest, uv.x(), uv.y());
      const double area = panel.quadrature.weights[p] * jet.area_scale();
      const MaterialPoint point = body.material_point(static_cast<int>(k), uv.x(), uv.y());
      for (std::size_t i = 0; i < point.index.size(); ++i)
        for (int c = 0; c < 3; ++c) sum(point.index[i], c) += area * point.value[c][i];
    }
  }
  return sum;
}

Eigen::VectorXd shares(const Matrix& values, const Eigen::VectorXd& cloth) {
  Eigen::VectorXd reach = Eigen::VectorXd::Zero(cloth.size()), out = Eigen::VectorXd::Zero(values.rows());
  for (int r = 0; r < values.rows(); ++r)
    for (Matrix::InnerIterator e(values, r); e; ++e) reach[e.col()] += std::max(e.value(), 0.0);
  for (int r = 0; r < values.rows(); ++r)
    for (Matrix::InnerIterator e(values, r); e; ++e)
      if (e.value() > 0) out[r] += std::max(cloth[e.col()], 0.0) * e.value() / reach[e.col()];
  return out;
}

// z that makes |A z - c|^2 + damping^2 |z|^2 least within the bounds of 1 + z: projected Newton steps, each by
// conjugate gradients over the unknowns that no bound holds; downhill where such a step leads nowhere. [Bertsekas 1982;
// Bjorck 1996, 7.4]
Eigen::VectorXd bounded_least_squares(const Matrix& a, const Eigen::VectorXd& c, const RowAreaOptions& options) {
  const double shift = options.damping * options.damping, least = options.least - 1, most = options.most - 1;
  const auto energy = [&](const Eigen::VectorXd& z) { return (a * z - c).squaredNorm() + shift * z.squaredNorm(); };
  Eigen::VectorXd z = Eigen::VectorXd::Zero(a.cols());
  const auto moves = [&](const Eigen::VectorXd& step) {
    const double before = energy(z);
    for (double part = 1; part > 1e-9; part /= 2) {
      const Eigen::VectorXd moved = (z + part * step).cwiseMax(least).cwiseMin(most);
      if (!(energy(moved) < before)) continue;
      z = moved;
      return true;
    }
    return false;
  };
  double enough = -1;
  for (int newton = 0; newton < options.newton_steps; ++newton) {
    Eigen::VectorXd downhill = a.transpose() * (c - a * z) - shift * z, free(z.size());
    for (Eigen::Index r = 0; r < z.size(); ++r)
      free[r] = (z[r] <= least && downhill[r] < 0) || (z[r] >= most && downhill[r] > 0) ? 0 : 1;
    downhill.array() *= free.array();
    double size = downhill.squaredNorm();
    if (enough < 0) enough = 1e-20 * size;
    if (size <= enough) break;
    Eigen::VectorXd step = Eigen::VectorXd::Zero(z.size()), direction = downhill, steepest;
    for (int k = 0; k < options.iterations && size > enough; ++k) {
      const Eigen::VectorXd image = a * direction;
      const double length = size / (image.squaredNorm() + shift * direction.squaredNorm());
      step += length * direction;
      if (k == 0) steepest = step;
      downhill -= length * free.cwiseProduct(a.transpose() * image + shift * direction);
      const double next = downhill.squaredNorm();
      direction = downhill + next / size * direction;
      size = next;
    }
    if (!moves(step) && !moves(steepest)) break;  // at the bottom within rounding
  }
  return z;
}

}  // namespace

void weigh_rows(const Body& body, const AffineMap& map, const std::vector<ScalarRow>& values,
                std::vector<StrainRow>& rows, const RowAreaOptions& options) {
  if (rows.empty()) return;
  const int n = body.point_count();
  const Matrix nodes = map.all();
  const Eigen::MatrixX3d whole = nodes.transpose() * integrals(body);
  for (const bool warp : {false, true}) {
    std::vector<std::size_t> members;
    for (std::size_t r = 0; r < rows.size(); ++r)
      if (rows[r].warp == warp) members.push_back(r);
    const Matrix reach = matrix_of(members, n, [&](std::size_t r) -> const ScalarRow& { return values[r]; }) * nodes;
    const Matrix slopes = matrix_of(members, n, [&](std::size_t r) -> const ScalarRow& { return rows[r].row; }) * nodes;
    const Eigen::VectorXd share = shares(reach, whole.col(0));
    // One equation a node, for the areas over their shares less 1; each panel's longest of unit length.
    Matrix equations = slopes.transpose() * share.asDiagonal();
    Eigen::VectorXd missing = whole.col(warp ? 2 : 1) - slopes.transpose() * share;
    const auto panel_of = [&](int equation) {  // rows of other panels don't meet its node; -1: none does
      const Matrix::InnerIterator e(equations, equation);
      return e ? rows[members[static_cast<std::size_t>(e.col())]].panel : -1;
    };
    std::vector<double> longest(body.panels().size(), 0);
    for (int i = 0; i < equations.rows(); ++i)
      if (const int panel = panel_of(i); panel >= 0) longest[panel] = std::max(longest[panel], equations.row(i).norm());
    for (int i = 0; i < equations.rows(); ++i) {
      const int panel = panel_of(i);
      const double scale = panel >= 0 && longest[panel] > 0 ? 1 / longest[panel] : 0;
      equations.row(i) *= scale;
      missing[i] *= scale;
    }
    const Eigen::VectorXd factor = 1 + bounded_least_squares(equations, missing, options).array();
    // What the bounds take or give is made up for by all rows of the panel alike.
    std::vector<double> shared(body.panels().size(), 0), weighed(shared);
    for (std::size_t k = 0; k < members.size(); ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      StrainRow& row = rows[members[k]];
      row.area = share[i] * factor[i];
      shared[row.panel] += share[i];
      weighed[row.panel] += row.area;
    }
    for (const std::size_t r : members)
      if (weighed[rows[r].panel] > 0) rows[r].area *= shared[rows[r].panel] / weighed[rows[r].panel];
  }
  std::vector<double> sum(body.panels().size(), 0), count(sum);
  for (const StrainRow& row : rows) {
    sum[row.panel] += row.area;
    ++count[row.panel];
  }
  for (StrainRow& row : rows) row.area = std::max(row.area, least_area * sum[row.panel] / count[row.panel]);
}

Eigen::Vector2d unbalanced_part(const Body& body, const AffineMap& map, const std::vector<StrainRow>& rows) {
  const Eigen::MatrixX3d whole = map.free_part().transpose() * integrals(body);
  Eigen::Vector2d part;
  for (const bool warp : {false, true}) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(body.point_count());
    for (const StrainRow& row : rows)
      for (std::size_t k = 0; row.warp == warp && k < row.row.index.size(); ++k)
        sum[row.row.index[k]] += row.area * row.row.value[k];
    const auto wanted = whole.col(warp ? 2 : 1);
    const double size = wanted.lpNorm<1>();
    part[warp ? 1 : 0] = size > 0 ? (map.free_part().transpose() * sum - wanted).lpNorm<1>() / size : 0;
  }
  return part;
}

}  // namespace toile
