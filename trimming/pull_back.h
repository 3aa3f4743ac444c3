// SPDX-License-Identifier: GPL-3.0-or-later
// Pull-back: the parameter curve of a curve in space that lies on a surface.
#pragma once

#include <array>
#include <optional>

#include "geometry/nurbs_curve.h"
#include "geometry/nurbs_surface.h"

namespace toile {

// Whether opposite edges of the surface are one curve in space, within `tolerance` (length).
std::array<bool, 2> closed_directions(const NurbsSurface& surface, double tolerance);

// c with S(c(t)) the point of the surface nearest to M(t).
//   (1) c has M's domain and direction.
//   (2) It is continuous: where it crosses the seam of a closed surface it runs on beyond the domain, by whole periods.
//   (3) A coordinate that stays within the tolerance of a knot line or of its own start is that number bitwise; where
//       both c's coordinates go monotonously and one is constant, c is a straight segment.
//   (4) `error` bounds |S(c) - S(nearest)| at 17 places a span [unit of the net]; for a straight segment of (3) it
//       is the distance as a point set.
struct PulledCurve {
  Curve2 curve;
  double error = 0;
  double distance = 0;             // largest distance of M's points from the surface, same unit
  Eigen::Vector3d place{0, 0, 0};  // where on M
};
struct PullBackOptions {
  double tolerance = 1e-9;  // relative to the diagonal of the surface's net
  // Length within which a coordinate counts as constant, unit of the net; at least the tolerance.
  double snap = 0;
  // Largest distance of M from the surface, relative to the same diagonal. Where M lies off by d, c is followed to d /
  // 100.
  double max_distance = 0.1;
  // Where c begins, about: tells the two sides of a seam apart. Unset: a search over the whole surface.
  std::optional<Eigen::Vector2d> start = {};
};
// Throws GeometryError where the nearest points don't form a curve: M leaves the surface by more than a tenth of its
// size.
PulledCurve pull_back(const NurbsSurface& surface, const Curve3& model, const PullBackOptions& options = {});

}  // namespace toile
