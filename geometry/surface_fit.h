// SPDX-License-Identifier: GPL-3.0-or-later
// Spline surfaces that interpolate a function of two parameters: offsets, and whatever else no NURBS is exactly.
#pragma once

#include <functional>
#include <vector>

#include "geometry/nurbs_surface.h"

namespace toile {

// Where the function may lack smoothness, per direction: ascending values, the first and last being the domain, each
// with the continuity of the result there (0 to 2; those at the ends are of no meaning).
struct FitBreak {
  double at = 0;
  int continuity = 2;
};

// Bicubic, interpolating `f` at the Greville abscissae of a mesh that is halved until the error, tried at twelve places
// a cell, is within `tolerance` or a direction has `max_spans` spans. Throws GeometryError where f isn't finite.
struct SurfaceFit {
  NurbsSurface surface;
  double error = 0;  // largest distance found
};
SurfaceFit fit_surface(const std::function<Eigen::Vector3d(double u, double v)>& f, const std::vector<FitBreak>& u,
                       const std::vector<FitBreak>& v, double tolerance, int max_spans = 128);

}  // namespace toile
