// SPDX-License-Identifier: GPL-3.0-or-later
// Flat panels from plane outlines: what pattern files hold instead of surfaces.
#pragma once

#include <vector>

#include "geometry/refine.h"
#include "geometry/trimmed_surface.h"

namespace toile {

// A face over the plane (u, v) -> origin + u du + v dv, bounded by closed chains of curves in (u, v), head to tail
// (none reversed):
//   (1) loop 0 is the outer one, the others are holes; the curves are the given ones, numbered as they are;
//   (2) the domain is the bounding box of the outer loop's control points, which holds the curves;
//   (3) the surface has degree 2 and one span a direction: a pattern names no knots, a drape chooses them.
// Throws GeometryError where an outline has no curve or its box no width.
TrimmedSurface flat_panel(std::vector<std::vector<TrimCurve>> loops, const AffinePatch& plane);

// Area that a closed chain encloses, positive where it runs counter-clockwise; each curve taken as its control polygon
// is, exact for lines. Tells outlines apart by size; who is inside whom is decided exactly (trimming/loops.h).
double polygon_area(const std::vector<TrimCurve>& loop);

// The polyline through these points (two or more), one span a segment of length 1.
Curve2 polyline_curve(const std::vector<Eigen::Vector2d>& points);

}  // namespace toile
