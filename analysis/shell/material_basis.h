// SPDX-License-Identifier: GPL-3.0-or-later
// Surface functions differentiated along the fabric's rest directions instead of the parameters. [Peng & Zheng 2022,
// eqs. 5-7 and the transformation of kappa]
#pragma once

#include <Eigen/Core>
#include <array>

#include "analysis/shell/shell_model.h"

namespace toile {

// Row r of `value` holds N, N_,1, N_,2, N_,11, N_,22, N_,12 (weft = 1, warp = 2); entry a + (p_u+1) b belongs to
// control point (first_u + a, first_v + b) of the panel. Second derivatives are (d xi / dX)(d xi / dX) N_,xi xi: only
// their part along the normal means a curvature, the tangential part depends on the parameters.
//   (1) row 0 sums to 1, the others to 0; (2) at rest the tangents are orthonormal.
struct MaterialBasis {
  int first_u = 0, first_v = 0, count_u = 0, count_v = 0;
  double jacobian = 0;    // rest area per parameter area
  Eigen::Matrix2d chain;  // d(u, v) / d(X1, X2), eq. (5) inverted
  std::array<std::array<double, SurfaceBasis::capacity>, 6> value;
  int size() const { return count_u * count_v; }
};

// At (u, v), on the named spans (knot indices). Throws GeometryError with panel and place where the rest surface has no
// tangent plane.
void evaluate_material_basis(const ClothPanel& panel, int span_u, int span_v, double u, double v, MaterialBasis& out);

}  // namespace toile
