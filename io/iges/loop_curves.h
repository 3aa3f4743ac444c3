// SPDX-License-Identifier: GPL-3.0-or-later
// Which curves of a boundary to believe, and their order and direction in the parameter plane.
#pragma once

#include "io/iges/face_plane.h"

namespace toile::iges {

// The curves of a boundary as a loop: the file's parameter curves, or its model curves pulled back onto the surface.
// Says in `boundary.converted` what was done to them. Throws GeometryError where there are none that can be used.
std::vector<TrimCurve> loop_curves(const FacePlane& plane, const ParameterMap& map, BoundaryCurves& boundary);

}  // namespace toile::iges
