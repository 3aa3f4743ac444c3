// SPDX-License-Identifier: GPL-3.0-or-later
// Trim curves as polylines on a surface, for drawing.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "geometry/nurbs_surface.h"
#include "geometry/trimmed_surface.h"

namespace toile {

// Parameters on `curve.curve` in the loop's direction of traversal, ends and knots included. Between neighbours the
// curve on the surface leaves the chord by at most `chord` times the size of the net's bounding box, as far as samples
// at the quarters show; at least 8 pieces per span, straight or not, since the surface bends below it.
std::vector<double> polyline_parameters(const NurbsSurface& surface, const TrimCurve& curve, double chord = 2e-4);

// The same as points of the surface.
std::vector<Eigen::Vector3d> surface_polyline(const NurbsSurface& surface, const TrimCurve& curve, double chord = 2e-4);

}  // namespace toile
