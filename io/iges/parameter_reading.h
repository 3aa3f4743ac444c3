// SPDX-License-Identifier: GPL-3.0-or-later
// What the file's parameters count: exporters disagree with the standard, and model curves tell.
#pragma once

#include <vector>

#include "io/iges/face_plane.h"

namespace toile::iges {

// A point of the surface under a parameter that may lie a period away. Beyond an open border the polynomial goes on.
Eigen::Vector3d point_at(const FacePlane& plane, Eigen::Vector2d uv);

// Parameter curves nearer than this to their model curves draw the same trim [unit of the net].
double agreed(const FacePlane& plane);

// How far a boundary's parameter curves, mapped, lie from its model curves: ends and middles of curves that are
// paired, else starts and middles against the nearest model curve.
double disagreement(const FacePlane& plane, const BoundaryCurves& b, const ParameterMap& map);

// Which reading of the file's parameters is meant: the standard's where its curves agree with the model curves, else
// the one that agrees best. Without model curves the standard's, unless the curves stay in the domain under another
// only. A reading that isn't the standard's is noted.
const ParameterMap& best_map(const FacePlane& plane, const std::vector<BoundaryCurves>& boundaries);

}  // namespace toile::iges
