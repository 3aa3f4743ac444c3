// SPDX-License-Identifier: GPL-3.0-or-later
// The material of a face as triangles in space, as fine as a chord error asks for.
#pragma once

#include "geometry/triangle_mesh.h"
#include "geometry/trimmed_surface.h"

namespace toile {

struct FaceTriangles {
  TriangleMesh mesh;  // unit of the net; counter-clockwise seen from the side of S_u x S_v
  double chord_error =
      0;  // farthest that a triangle's middle, or that of an edge, is from the surface at its parameters
};

// Triangles no farther than `chord_error` [unit of the net] from the surface, and a quarter of that from the trims; as
// coarse as that allows. Where a surface is so bent in a point that 4 million triangles don't reach it, the result says
// what was reached. The loops must be valid (loops.h). Throws GeometryError as trace_trims and triangulate do.
FaceTriangles face_triangles(const TrimmedSurface& face, double chord_error);

}  // namespace toile
