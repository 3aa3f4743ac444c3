// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces by pointer, as NURBS where their matrices put them.
#pragma once

#include <string>
#include <vector>

#include "io/iges/face.h"
#include "io/iges/reading.h"

namespace toile::iges {

// `boundaries` are those of the face: they end planes, cylinders and cones, which have no end of their own. `name`: the
// surface's, where it has one.
FileSurface surface_of(Reading& reading, const Entry& e, const std::vector<BoundaryCurves>& boundaries,
                       std::string& name);

}  // namespace toile::iges
