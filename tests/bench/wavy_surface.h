// SPDX-License-Identifier: GPL-3.0-or-later
// A bicubic surface of garment size in millimetres that no two faces share: what the IGES benchmarks read and write.
#pragma once

#include <cmath>

#include "geometry/nurbs_surface.h"

namespace toile::bench {

inline NurbsSurface wavy_surface(int spans, int number) {
  const KnotVector knots = uniform_knots(3, spans, {0, 1});
  const int n = knots.control_point_count();
  Eigen::Matrix3Xd points(3, n * n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double u = knots.greville(i), v = knots.greville(j);
      points.col(i + n * j) << 700 * u + 3 * number, 500 * v + std::sin(9 * u),
          40 * std::sin(5 * u + number) * std::cos(4 * v);
    }
  return NurbsSurface(knots, knots, points);
}

}  // namespace toile::bench
