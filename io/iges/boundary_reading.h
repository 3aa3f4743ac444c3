// SPDX-License-Identifier: GPL-3.0-or-later
// Boundaries of faces: 142, 141 and 508, all to the same curves.
#pragma once

#include "io/iges/face.h"
#include "io/iges/reading.h"

namespace toile::iges {

// The curves of a boundary of the face on `surface` (a directory number). Empty for a loop 508 that is one vertex.
BoundaryCurves boundary_of(Reading& reading, const Entry& e, int surface);

}  // namespace toile::iges
