// SPDX-License-Identifier: GPL-3.0-or-later
// Energy, force and tangent of the bending strip at one point of a kink (kink_strip.h).
//
//   a        derivative of the deformed place along the line, the same from both sides
//   w-, w+   derivatives across the line at rest, from the side before and from the side after
//   n-, n+   unit normals w x a / |w x a|;  theta = angle from n- to n+ about a
#pragma once

#include <vector>

#include "analysis/shell/kink_strip.h"
#include "analysis/shell/point_kernel.h"

namespace toile {

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
KinkStrip make_kink_strip(const ShellPanel& panel, int panel_number, int first_control_point, const KinkPoint& point);

// Subtracts the gradient from `force` (of all control points); returns the energy [J].
double add_kink_force(const KinkStrip& strip, const PointLaw& law, const double* q, double* force);
// Subtracts K dq from `minus_df` unless it is null; returns dq . K dq.
double add_kink_tangent(const KinkStrip& strip, const PointLaw& law, const double* q, const double* dq,
                        double* minus_df);

}  // namespace toile
