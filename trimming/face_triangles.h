// SPDX-License-Identifier: GPL-3.0-or-later
// The material of a face as triangles in space, as fine as a chord error asks for.
#pragma once

#include "geometry/triangle_mesh.h"
#include "geometry/trimmed_surface.h"

namespace toile {

struct FaceTriangles {
  TriangleMesh mesh;       // unit of the net; counter-clockwise seen from the side of S_u x S_v
  double chord_error = 0;  // largest that was measured
};

// Triangles whose edges, at three places each, and whose middles are within `chord_error` [unit of the net] of the
// surface at the same parameters; edges along a trim within that of the trim. Coarse where the face is flat. Where 4
// million triangles don't do, the result says what was reached. The loops must be valid (loops.h). Throws GeometryError
// as trace_trims and triangulate do.
FaceTriangles face_triangles(const TrimmedSurface& face, double chord_error);

}  // namespace toile
