// SPDX-License-Identifier: GPL-3.0-or-later
// A flat polynomial unit square in x and y with everything that projection needs to know about it, without a shell
// model.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

#include "analysis/constraint/constraint_rows.h"
#include "analysis/map/affine_map.h"
#include "geometry/basis.h"
#include "geometry/nurbs_surface.h"

namespace toile::test {

struct FlatCloth {
  KnotVector knots;
  int n = 0;             // control points per direction
  Eigen::VectorXd rest;  // 3 n^2
  Eigen::VectorXd mass;  // n^2, row sums at 1 kg/m2
};

inline FlatCloth flat_cloth(int degree, int spans) {
  FlatCloth c;
  c.knots = uniform_knots(degree, spans);
  c.n = c.knots.control_point_count();
  c.rest.resize(3 * c.n * c.n);
  c.mass.resize(c.n * c.n);
  const auto share = [&](int i) { return (c.knots[i + degree + 1] - c.knots[i]) / (degree + 1); };
  for (int j = 0; j < c.n; ++j)
    for (int i = 0; i < c.n; ++i) {
      c.rest.segment<3>(3 * (i + c.n * j)) = Eigen::Vector3d(c.knots.greville(i), c.knots.greville(j), 0);
      c.mass[i + c.n * j] = share(i) * share(j);
    }
  return c;
}

// The row of N (order 0), N_,x (1) or N_,y (2) at (u, v), zeros left out.
inline ScalarRow scalar_row(const FlatCloth& c, double u, double v, int which) {
  const BasisValues bu = evaluate_basis(c.knots, u, 1), bv = evaluate_basis(c.knots, v, 1);
  ScalarRow row;
  for (int b = 0; b <= bv.degree; ++b)
    for (int a = 0; a <= bu.degree; ++a) {
      const double value = bu.value[which == 1][a] * bv.value[which == 2][b];
      if (std::abs(value) < 1e-14) continue;
      row.index.push_back(bu.first + a + c.n * (bv.first + b));
      row.value.push_back(value);
    }
  return row;
}

// Weft and warp at every vertex of the knot mesh.
inline std::vector<StrainRow> vertex_rows(const FlatCloth& c) {
  std::vector<StrainRow> rows;
  int point = 0;
  for (double v : c.knots.breaks())
    for (double u : c.knots.breaks()) {
      for (int which : {1, 2}) rows.push_back({scalar_row(c, u, v, which), 0, point, which == 2});
      ++point;
    }
  return rows;
}

// Nothing held.
inline AffineMap free_map(const FlatCloth& c) {
  return AffineMap(AffineMap::identity(c.n * c.n), {}, nullptr);
}

inline Eigen::VectorXd disturbed(const Eigen::VectorXd& q, double size, unsigned seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> draw(-size, size);
  Eigen::VectorXd out = q;
  for (double& value : out) value += draw(rng);
  return out;
}

// Linear, then angular about the origin, per node with its mass.
inline Eigen::Matrix<double, 6, 1> momenta(const Eigen::VectorXd& mass, const Eigen::VectorXd& x,
                                           const Eigen::VectorXd& v) {
  Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
  for (int k = 0; k < mass.size(); ++k) {
    const Eigen::Vector3d p = mass[k] * v.segment<3>(3 * k), at = x.segment<3>(3 * k);
    sum.head<3>() += p;
    sum.tail<3>() += at.cross(p);
  }
  return sum;
}

inline double strain(const ScalarRow& row, const Eigen::VectorXd& q) {
  return 0.5 * (apply(row, q).squaredNorm() - 1);
}

}  // namespace toile::test
