// SPDX-License-Identifier: GPL-3.0-or-later
// C0 knot lines: the cloth goes on across them, so a bend there costs what bending a narrow strip of the same cloth
// costs. [after the bending strips of Kiendl et al. 2010, with the angle itself in place of their fictitious surface]
//
// Per length of line: width * psi((theta - theta0) / width), theta the angle by which the tangent plane turns across
// the line, theta0 at rest (0 where the fabric's rest curvature is), psi the fabric's bending energy for a curvature
// across the line, width a tenth of the narrower neighbouring cell. No membrane, no mass.
//
// Here: energy, force and tangent at one point of a kink.
//   a        derivative of the deformed place along the line, the same from both sides
//   w-, w+   derivatives across the line at rest, from the side before and from the side after
//   n-, n+   unit normals w x a / |w x a|;  theta = angle from n- to n+ about a
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "analysis/model/cloth_panel.h"
#include "analysis/shell/point_kernel.h"

namespace toile {

// Width of the strip as part of the narrower neighbouring cell: a line makes the cloth softer by this part of a cell,
// and where bending bounds the step, the bound falls to about a third. (analysis/shell/README.md, "C0 lines")
constexpr double strip_width = 0.1;

// One point with the functions that don't vanish there.
struct KinkStrip {
  int panel = 0, cell_i = 0, cell_j = 0;  // the cell after the line
  double length = 0, width = 0;           // m at rest
  double weft = 0, warp = 0, twist = 0;   // kappa11, kappa22, kappa12 of a unit curvature across the line
  double rest_angle = 0;
  std::vector<int> index;                    // control points, global
  std::vector<double> along, before, after;  // rows of a, w-, w+
};

// Throws GeometryError where the rest surface has no tangent plane on one of the sides.
KinkStrip make_kink_strip(const ClothPanel& panel, int panel_number, int first_control_point, const KinkPoint& point);

// Subtracts the gradient from `force` (of all control points); returns the energy [J].
double add_kink_force(const KinkStrip& strip, const PointLaw& law, const double* q, double* force);
// Subtracts K dq from `minus_df` unless it is null; returns dq . K dq.
double add_kink_tangent(const KinkStrip& strip, const PointLaw& law, const double* q, const double* dq,
                        double* minus_df);

// Second derivative of the strip's energy with respect to a, w-, w+, nine numbers; TangentKind::positive: what the
// slope of the law gives, without the turning of the angle's gradient.
using KinkHessian = Eigen::Matrix<double, 9, 9>;
KinkHessian kink_hessian(const KinkStrip& strip, const PointLaw& law, const double* q, TangentKind kind);
// Its block of the strip's i-th and j-th control points.
Eigen::Matrix3d kink_block(const KinkStrip& strip, const KinkHessian& hessian, std::size_t i, std::size_t j);

}  // namespace toile
