// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/constraint/stress_recovery.h"

#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <utility>

#include "analysis/constraint/composed_rows.h"
#include "analysis/linear/cholesky.h"
#include "geometry/error.h"

namespace toile {

std::vector<ThreadStress> row_stress(const Body& body, const ConstraintRows& rows,
                                     const Eigen::Ref<const Eigen::VectorXd>& row_force,
                                     const Eigen::Ref<const Eigen::VectorXd>& q) {
  std::vector<ThreadStress> out;
  for (std::size_t r = 0; r < rows.strain.size(); ++r) {
    const StrainRow& row = rows.strain[r];
    const MaterialState fabric = body.state(row.panel, row.uv.x(), row.uv.y(), q);
    const double limit = row_force[static_cast<Eigen::Index>(r)] / row.area;
    const Eigen::Vector2d share = row.thread.cwiseAbs2();
    out.push_back(
        {share.dot(fabric.second_pk.head<2>()) + limit / apply(row.row, q).norm(), share.dot(fabric.nominal) + limit});
  }
  return out;
}

namespace {

constexpr double dependent = 1e-6;  // part of a place row's size that keeps rows apart which say the same

using Matrix = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

// The nodes that the functions `index` of a cell depend on, and how.
struct CellNodes {
  CellNodes(const AffineMap::Matrix& all, const std::vector<int>& index) {
    for (const int i : index)
      for (AffineMap::Matrix::InnerIterator e(all, i); e; ++e) node.push_back(static_cast<int>(e.col()));
    std::ranges::sort(node);
    node.erase(std::unique(node.begin(), node.end()), node.end());
    transposed = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(node.size()), static_cast<Eigen::Index>(index.size()));
    for (std::size_t k = 0; k < index.size(); ++k)
      for (AffineMap::Matrix::InnerIterator e(all, index[k]); e; ++e)
        transposed(std::ranges::lower_bound(node, static_cast<int>(e.col())) - node.begin(),
                   static_cast<Eigen::Index>(k)) = e.value();
  }
  // Row `which` of a material point as functions of the nodes.
  Eigen::VectorXd functions(const MaterialPoint& point, int which) const {
    const std::vector<double>& value = point.value[static_cast<std::size_t>(which)];
    return transposed * Eigen::Map<const Eigen::VectorXd>(value.data(), static_cast<Eigen::Index>(value.size()));
  }

  std::vector<int> node;  // ascending
  Eigen::MatrixXd transposed;
};

std::array<Eigen::Vector3d, 2> threads(const MaterialPoint& point, const Eigen::Ref<const Eigen::VectorXd>& q) {
  std::array<Eigen::Vector3d, 2> y{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (std::size_t k = 0; k < point.index.size(); ++k)
    for (std::size_t d = 0; d < 2; ++d) y[d] += point.value[d + 1][k] * q.segment<3>(3 * point.index[k]);
  return y;
}

// Unknowns: S1, S2, S12 of node 0, 1, ...; equations: x, y, z of the free nodes. Integrals over the cloth.
struct Integrals {
  Triplets forces;         // A
  Triplets slopes, sizes;  // of one component: integral |grad S|^2, integral S^2
  Eigen::VectorXd force;   // of the fabric's own stress on free nodes
  Eigen::VectorXd shear;   // integral N S12 of the fabric
  std::vector<double> area;
};

void add_cell(const Body& body, int panel, const CellRule& cell, const AffineMap& map, const AffineMap::Matrix& all,
              const Eigen::Ref<const Eigen::VectorXd>& q, Integrals& sum) {
  const ClothPanel& cloth = body.panels()[static_cast<std::size_t>(panel)];
  std::optional<CellNodes> nodes;
  Eigen::MatrixXd forces, slopes, sizes;
  for (int p = cell.first; p < cell.first + cell.count; ++p) {
    const Eigen::Vector2d& uv = cloth.quadrature.points[static_cast<std::size_t>(p)];
    const MaterialPoint point = body.material_point(panel, uv.x(), uv.y());
    if (!nodes) {
      nodes.emplace(all, point.index);
      const auto n = static_cast<Eigen::Index>(nodes->node.size());
      forces = Eigen::MatrixXd::Zero(3 * n, 3 * n);
      slopes = sizes = Eigen::MatrixXd::Zero(n, n);
    }
    const double area =
        cloth.quadrature.weights[static_cast<std::size_t>(p)] * evaluate(cloth.rest, uv.x(), uv.y()).area_scale();
    std::array<Eigen::VectorXd, 3> f;
    for (int k = 0; k < 3; ++k) f[static_cast<std::size_t>(k)] = nodes->functions(point, k);
    const auto& [value, weft, warp] = f;
    const auto [y1, y2] = threads(point, q);
    const std::array<Eigen::VectorXd, 3> pull{(y1 * weft.transpose()).reshaped(), (y2 * warp.transpose()).reshaped(),
                                              (y1 * warp.transpose() + y2 * weft.transpose()).reshaped()};
    const Eigen::Vector3d own = body.state(panel, uv.x(), uv.y(), q).second_pk;
    for (Eigen::Index j = 0; j < value.size(); ++j) {
      const int node = nodes->node[static_cast<std::size_t>(j)];
      for (Eigen::Index c = 0; c < 3; ++c) {
        forces.col(3 * j + c) -= area * value[j] * pull[static_cast<std::size_t>(c)];
        if (node < map.nodes())
          sum.force.segment<3>(3 * node) -= area * own[c] * pull[static_cast<std::size_t>(c)].segment<3>(3 * j);
      }
      sum.shear[node] += area * value[j] * own[2];
      sum.area[static_cast<std::size_t>(node)] += area * value[j];
    }
    slopes += area * (weft * weft.transpose() + warp * warp.transpose());
    sizes += area * value * value.transpose();
  }
  if (!nodes) return;
  const auto n = static_cast<int>(nodes->node.size());
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const int row = nodes->node[static_cast<std::size_t>(i)], column = nodes->node[static_cast<std::size_t>(j)];
      for (int a = 0; a < 3; ++a)
        for (int c = 0; row < map.nodes() && c < 3; ++c)
          sum.forces.emplace_back(3 * row + a, 3 * column + c, forces(3 * i + a, 3 * j + c));
      sum.slopes.emplace_back(row, column, slopes(i, j));
      sum.sizes.emplace_back(row, column, sizes(i, j));
    }
}

Matrix made(Eigen::Index rows, Eigen::Index columns, const Triplets& entries) {
  Matrix out(rows, columns);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

// x of H x = b; only the lower triangle of H is read.
Eigen::VectorXd solved(const Matrix& h, const Eigen::VectorXd& b) {
  SparsePattern pattern{{0}, {}};
  std::vector<double> values;
  for (int c = 0; c < h.cols(); ++c) {
    for (Matrix::InnerIterator e(h, c); e; ++e) {
      if (e.row() < c) continue;
      pattern.row.push_back(static_cast<int>(e.row()));
      values.push_back(e.value());
    }
    pattern.column_start.push_back(static_cast<int>(pattern.row.size()));
  }
  Cholesky factor(std::move(pattern));
  if (!factor.factorise(values)) throw SolverError("the stress can't be recovered: its equations are singular");
  Eigen::VectorXd x(b.size());
  factor.solve(b, x);
  return x;
}

// A quadratic to be made least: x . matrix x - 2 right . x.
struct Quadratic {
  Triplets& matrix;
  Eigen::VectorXd& right;
};

// weight area (S along the row's thread - what fabric and row carry there)^2.
void add_row(const Body& body, const StrainRow& row, const Eigen::Vector3d& force, const AffineMap::Matrix& all,
             const Eigen::Ref<const Eigen::VectorXd>& q, double weight, const Quadratic& out) {
  const Eigen::Vector3d y = apply(row.row, q);
  const Eigen::Vector2d share = row.thread.cwiseAbs2();
  const double stress = share.dot(body.state(row.panel, row.uv.x(), row.uv.y(), q).second_pk.head<2>()) +
                        force.dot(y) / (y.squaredNorm() * row.area);
  const MaterialPoint point = body.material_point(row.panel, row.uv.x(), row.uv.y());
  const CellNodes nodes(all, point.index);
  const Eigen::VectorXd value = nodes.functions(point, 0);
  for (std::size_t i = 0; i < nodes.node.size(); ++i)
    for (int c = 0; c < 2; ++c) {
      const double at = weight * row.area * share[c] * value[static_cast<Eigen::Index>(i)];
      out.right[3 * nodes.node[i] + c] += at * stress;
      for (std::size_t j = 0; j < nodes.node.size(); ++j)
        for (int d = 0; d < 2; ++d)
          out.matrix.emplace_back(3 * nodes.node[i] + c, 3 * nodes.node[j] + d,
                                  at * share[d] * value[static_cast<Eigen::Index>(j)]);
    }
}

}  // namespace

StressField::StressField(const Body& body, const AffineMap& map, const ConstraintRows& rows,
                         const Eigen::Ref<const Eigen::Matrix3Xd>& row_forces,
                         const Eigen::Ref<const Eigen::VectorXd>& q, const Options& options)
    : body_(body), q_(q) {
  const AffineMap::Matrix all = map.all();
  const auto n = static_cast<int>(all.cols());
  Integrals sum;
  sum.force = Eigen::VectorXd::Zero(3 * map.nodes());
  sum.shear = Eigen::VectorXd::Zero(n);
  sum.area.assign(static_cast<std::size_t>(n), 0);
  for (int k = 0; k < static_cast<int>(body.panels().size()); ++k)
    for (const CellRule& cell : body.panels()[static_cast<std::size_t>(k)].quadrature.cells)
      add_cell(body, k, cell, map, all, q, sum);
  std::vector<double> area;
  std::ranges::copy_if(sum.area, std::back_inserter(area), [](double a) { return a > 0; });
  std::ranges::nth_element(area, area.begin() + static_cast<std::ptrdiff_t>(area.size() / 2));
  const double h2 = area[area.size() / 2];

  // Unknowns behind the stress: what place rows take up.
  const ComposedRows place = compose(map, {{}, rows.place});
  const int unknowns = 3 * n + 3 * place.free.size();
  Triplets other;
  for (int r = 0; r < place.free.size(); ++r) {
    const Eigen::Vector3d& axes = rows.place[static_cast<std::size_t>(r)].axes;
    double size = 0;
    for (int e = place.free.start[r]; e < place.free.start[r + 1]; ++e) {
      size += place.free.value[e] * place.free.value[e];
      for (int a = 0; a < 3; ++a)
        if (axes[a] != 0) sum.forces.emplace_back(3 * place.free.column[e] + a, 3 * (n + r) + a, place.free.value[e]);
    }
    for (int a = 0; a < 3; ++a)
      other.emplace_back(3 * (n + r) + a, 3 * (n + r) + a, size > 0 ? dependent * size / h2 : 1);
  }
  const auto add = [&](const Matrix& part, int component, double factor) {
    for (int k = 0; k < part.outerSize(); ++k)
      for (Matrix::InnerIterator e(part, k); e; ++e)
        other.emplace_back(3 * static_cast<int>(e.row()) + component, 3 * static_cast<int>(e.col()) + component,
                           factor * e.value());
  };
  const Matrix slopes = made(n, n, sum.slopes);
  for (int c = 0; c < 3; ++c) add(slopes, c, options.smoothing);
  add(made(n, n, sum.sizes), 2, options.shear * options.smoothing / h2);

  Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns), limit = Eigen::VectorXd::Zero(3 * body.point_count());
  for (int i = 0; i < n; ++i) right[3 * i + 2] = options.shear * options.smoothing / h2 * sum.shear[i];
  for (std::size_t r = 0; r < rows.strain.size(); ++r) {
    const StrainRow& row = rows.strain[r];
    const auto force = row_forces.col(static_cast<Eigen::Index>(r));
    for (std::size_t k = 0; k < row.row.index.size(); ++k)
      limit.segment<3>(3 * row.row.index[k]) -= row.row.value[k] * force;
    add_row(body, row, force, all, q, options.rows * options.smoothing / h2, {other, right});
  }
  Eigen::VectorXd force(3 * map.nodes());
  map.reduce(limit, force);
  force += sum.force;
  const Matrix forces = made(3 * map.nodes(), unknowns, sum.forces);
  // Nothing else might hold the stress of threads whose ends are both pinned and which no row sees.
  for (int i = 0; i < 3 * n; ++i) other.emplace_back(i, i, 1e-9 * options.smoothing);
  const Matrix normal = Matrix(forces.transpose()) * forces / h2 + made(unknowns, unknowns, other);
  right += forces.transpose() * force / h2;
  const Eigen::VectorXd found = solved(normal, right);
  stress_ = Eigen::Map<const Eigen::Matrix3Xd>(found.data(), 3, n) * all.transpose();
}

Eigen::Vector3d StressField::second_pk(int panel, double u, double v) const {
  const MaterialPoint point = body_.material_point(panel, u, v);
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < point.index.size(); ++k) out += point.value[0][k] * stress_.col(point.index[k]);
  return out;
}

std::array<ThreadStress, 2> StressField::at(int panel, double u, double v) const {
  const Eigen::Vector3d s = second_pk(panel, u, v);
  const auto [y1, y2] = threads(body_.material_point(panel, u, v), q_);
  return {ThreadStress{s[0], y1.norm() * s[0]}, ThreadStress{s[1], y2.norm() * s[1]}};
}

}  // namespace toile
