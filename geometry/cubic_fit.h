// SPDX-License-Identifier: GPL-3.0-or-later
// Cubic splines that follow a path: the image of a curve under a map, a curve offset or pulled back.
#pragma once

#include <functional>
#include <optional>
#include <span>

#include "geometry/nurbs_curve.h"

namespace toile {

template <int Dim>
struct PathPoint {
  Eigen::Matrix<double, Dim, 1> x, d;  // position and derivative
};

// One smooth piece of a path; `at` gives one-sided derivatives at its ends.
template <int Dim>
struct SmoothPath {
  Interval range;
  std::function<PathPoint<Dim>(double t)> at;
};

// Pieces follow one another. The spline interpolates position and derivative at the ends of pieces and wherever halving
// was needed for `tolerance`, tried at five places a span; C1 but where the path isn't.
//   (1) The domain is that of the path, its ends are the path's ends.
//   (2) `error` is the largest distance found at 17 places a span; above the tolerance where halving ended
//       (max_halvings) before it was met.
// `distance` measures how far x is from the path's point at t; unset: the plain distance.
template <int Dim>
struct CubicFit {
  NurbsCurve<Dim> curve;
  double error = 0;
};
template <int Dim>
struct CubicFitOptions {
  double tolerance = 0;
  int max_halvings = 20;
  std::function<double(double t, const Eigen::Matrix<double, Dim, 1>& path, const Eigen::Matrix<double, Dim, 1>& x)>
      distance = {};
};
template <int Dim>
CubicFit<Dim> fit_cubic(std::span<const SmoothPath<Dim>> path, const CubicFitOptions<Dim>& options);

}  // namespace toile
