// SPDX-License-Identifier: GPL-3.0-or-later
// Patches of triangles joined into one surface.
#pragma once

#include "geometry/triangle_mesh.h"

namespace toile {

// Borders that run along each other within `gap` become one, whatever points either of them has: border vertices nearer
// than a quarter of it are one, others split the edge that they lie on. No vertex moves farther than `gap`; nothing but
// borders changes. Where one part meets itself (the seam of a closed surface, a pole) it is joined too. Throws
// GeometryError for a number that isn't finite.
TriangleMesh join_borders(TriangleMesh mesh, double gap);

}  // namespace toile
