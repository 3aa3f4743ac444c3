// SPDX-License-Identifier: GPL-3.0-or-later
// The curve in space that a parameter curve draws on a surface: C(t) = S(c(t)).
#pragma once

#include <optional>

#include "geometry/nurbs_curve.h"
#include "geometry/nurbs_surface.h"
#include "geometry/refine.h"

namespace toile::iges {

struct ModelCurve {
  Curve3 curve;      // over the parameter curve's domain, in its direction and its parameter
  double error = 0;  // largest |C(t) - S(c(t))| found at 16 places a span, unit of the net
};

// Exact (affine image of the control points) on an affine patch, else a cubic that interpolates position and derivative
// at the knots of c, where c crosses knot lines of S, and at as many places between as the tolerance needs; C1 except
// where S(c) isn't. Where the tolerance can't be had, `error` says what was.
ModelCurve fit_model_curve(const NurbsSurface& surface, const Curve2& c, double tolerance,
                           const std::optional<AffinePatch>& patch = std::nullopt);

}  // namespace toile::iges
