// SPDX-License-Identifier: GPL-3.0-or-later
// The sums under every surface evaluation. Internal to geometry/.
#pragma once

#include <array>

#include "geometry/nurbs_surface.h"

namespace toile::detail {

// A, A_u, A_v, A_uu, A_uv, A_vv; homogeneous, the weight function last (1 throughout for polynomial surfaces).
using HomogeneousJet = std::array<Eigen::Vector4d, 6>;

// Control point k as (w P, w); for polynomial surfaces (P, 1).
inline Eigen::Vector4d homogeneous_point(const NurbsSurface& surface, int k) {
  Eigen::Vector4d point;
  point << surface.points().col(k), 1.0;
  if (surface.rational()) point *= surface.weights()[static_cast<std::size_t>(k)];
  return point;
}

// The quotient rule [Piegl & Tiller 1997, eq. 4.20].
inline SurfaceJet to_jet(const HomogeneousJet& h, bool rational) {
  if (!rational)
    return {h[0].head<3>(), h[1].head<3>(), h[2].head<3>(), h[3].head<3>(), h[4].head<3>(), h[5].head<3>()};
  SurfaceJet jet;
  const double scale = 1 / h[0][3];
  jet.x = h[0].head<3>() * scale;
  jet.u = (h[1].head<3>() - h[1][3] * jet.x) * scale;
  jet.v = (h[2].head<3>() - h[2][3] * jet.x) * scale;
  jet.uu = (h[3].head<3>() - 2 * h[1][3] * jet.u - h[3][3] * jet.x) * scale;
  jet.uv = (h[4].head<3>() - h[1][3] * jet.v - h[2][3] * jet.u - h[4][3] * jet.x) * scale;
  jet.vv = (h[5].head<3>() - 2 * h[2][3] * jet.v - h[5][3] * jet.x) * scale;
  return jet;
}

}  // namespace toile::detail
