// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/shell/material_basis.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "geometry/error.h"
#include "geometry/text.h"

namespace toile {

void evaluate_material_basis(const ClothPanel& panel, int span_u, int span_v, double u, double v, MaterialBasis& out) {
  SurfaceBasis basis;
  evaluate_basis_on_span(panel.rest, span_u, span_v, u, v, basis);
  out.first_u = basis.first_u;
  out.first_v = basis.first_v;
  out.count_u = basis.count_u;
  out.count_v = basis.count_v;

  Eigen::Vector3d A1 = Eigen::Vector3d::Zero(), A2 = Eigen::Vector3d::Zero();
  for (int b = 0; b < basis.count_v; ++b)
    for (int a = 0; a < basis.count_u; ++a) {
      const int k = a + basis.count_u * b;
      const auto Q = panel.rest.points().col(panel.rest.index(basis.first_u + a, basis.first_v + b));
      A1 += basis.value[1][k] * Q;
      A2 += basis.value[2][k] * Q;
    }
  const Eigen::Vector3d normal = A1.cross(A2);
  out.jacobian = normal.norm();
  if (!(out.jacobian > 1e-12 * A1.norm() * A2.norm()) || !std::isfinite(out.jacobian))
    throw GeometryError("panel " + panel.name + ": the surface has no tangent plane at u = " + text(u) +
                        ", v = " + text(v));

  const Eigen::Vector3d a3 = normal / out.jacobian;
  const Eigen::Vector3d u_direction = panel.straight_u ? *panel.straight_u - panel.straight_u->dot(a3) * a3 : A1;
  const Eigen::Vector3d along_u = u_direction.normalized(), across = a3.cross(along_u);
  const Eigen::Vector3d E1 = std::cos(panel.grain) * along_u + std::sin(panel.grain) * across;
  const Eigen::Vector3d E2 = std::cos(panel.grain) * across - std::sin(panel.grain) * along_u;
  Eigen::Matrix2d J;  // eq. (5)
  J << E1.dot(A1), E1.dot(A2), E2.dot(A1), E2.dot(A2);
  out.chain = J.inverse();
  const Eigen::Matrix2d& d = out.chain;

  const auto& N = basis.value;
  const auto second = [&](int a, int b, int k) {
    return d(0, a) * d(0, b) * N[3][k] + (d(0, a) * d(1, b) + d(1, a) * d(0, b)) * N[4][k] +
           d(1, a) * d(1, b) * N[5][k];
  };
  for (int k = 0; k < basis.size(); ++k) {
    out.value[0][k] = N[0][k];
    out.value[1][k] = d(0, 0) * N[1][k] + d(1, 0) * N[2][k];
    out.value[2][k] = d(0, 1) * N[1][k] + d(1, 1) * N[2][k];
    out.value[3][k] = second(0, 0, k);
    out.value[4][k] = second(1, 1, k);
    out.value[5][k] = second(0, 1, k);
  }
}

}  // namespace toile
