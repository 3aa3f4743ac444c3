// SPDX-License-Identifier: GPL-3.0-or-later
// One triangle mesh of a trimmed panel, for looking at it, for contact and for models on triangles: Delaunay refinement
// in the plane that the panel is rolled out into as well as an affine map can (a flat panel: exactly).
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "trimming/topology.h"

namespace toile {

// A vertex on a trim: uv is the curve at t.
struct BoundaryVertex {
  int vertex = 0;           // into TrimmedTriangles::uv
  int loop = 0, curve = 0;  // positions as in TrimEvent
  double t = 0;             // on that curve as given
};

// Lengths and angles on the surface at rest, of the straight edges between vertices.
struct TriangleQuality {
  double smallest_angle = 0;                   // rad
  double shortest_edge = 0, longest_edge = 0;  // unit of the net
};

//   (1) the triangles turn left in the parameter plane and share whole edges; together they cover the polygons between
//       the boundary vertices, which are the material but for the segments that chords cut off or add;
//   (2) no edge is much longer than the size asked for (twice, where the panel is far from flat); angles below 20
//       degrees are left only at sharp corners of the trim, at short boundary edges and where the panel is far from
//       flat;
//   (3) a curve with given points has exactly these and its ends as boundary vertices: panels that are given matching
//       points along a seam match there;
//   (4) boundary vertices are listed once per place and curve, in the order of the loops.
struct TrimmedTriangles {
  std::vector<Eigen::Vector2d> uv;
  std::vector<std::array<int, 3>> triangles;
  std::vector<BoundaryVertex> boundary;
  TriangleQuality quality;
};

// Parameters of the vertices between the ends of one curve, ascending.
struct GivenPoints {
  int loop = 0, curve = 0;  // positions as in TrimEvent
  std::vector<double> t;
};

struct TriangulationOptions {
  std::optional<double> size;  // edge length aimed at [unit of the net]; unset: a quarter of the mean cell's side
  double chord = 0.02;         // largest distance of a free boundary edge from its trim, as a fraction of the size
  std::vector<GivenPoints> given;
};

// Throws GeometryError for a size that isn't positive or would make more than four million triangles, for given points
// that are out of order, and where edges between given points cross others.
TrimmedTriangles triangulate(const TrimmedSurface& surface, const TrimTopology& topology,
                             const TriangulationOptions& options = {});

}  // namespace toile
