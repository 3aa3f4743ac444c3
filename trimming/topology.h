// SPDX-License-Identifier: GPL-3.0-or-later
// How the trim loops of a surface meet its knot lines: events, cells, vertices. Every decision here is exact (filtered
// interval arithmetic with exact rationals and algebraic numbers behind it); only coordinates are rounded.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "trimming/spans.h"

namespace toile {

// Distinct knot lines of a surface, the domain's border included; cell (i,j) = [u_i, u_i+1] x [v_j, v_j+1].
struct KnotMesh {
  std::vector<double> u, v;
  int cells_u() const { return static_cast<int>(u.size()) - 1; }
  int cells_v() const { return static_cast<int>(v.size()) - 1; }
  int cell(int i, int j) const { return i + cells_u() * j; }
  int vertex(int i, int j) const { return i + static_cast<int>(u.size()) * j; }
};
KnotMesh knot_mesh(const NurbsSurface& surface);

// Events have kinds from crossing_u to crossing_uv; the others are of constraint points.
enum class PointKind { vertex, crossing_u, crossing_v, tangent_u, tangent_v, crossing_uv, corner };
const char* name(PointKind kind);  // "vertex", "crossing_u", ... as in `toile inspect`

// A trim curve meets knot lines. Listed in traversal order, loop by loop.
struct TrimEvent {
  PointKind kind = PointKind::crossing_u;
  int loop = 0, curve = 0;       // positions in TrimmedSurface::loops and TrimLoop::curves (not the file's numbers)
  double t = 0;                  // on that curve as given (not reversed)
  Eigen::Vector2d uv{0, 0};      // a knot coordinate is bitwise the knot
  int line_u = -1, line_v = -1;  // index into KnotMesh::u / v, -1: none
};

enum class CellKind : std::uint8_t { outside, cut, inside };
enum class VertexKind : std::uint8_t { outside, border, inside };

// A piece of the boundary of the material inside one cell, in the direction that has the material on its left.
struct BoundaryPiece {
  int loop = -1, curve = -1;  // positions as in TrimEvent; -1: a straight piece of the cell's own border
  double t0 = 0, t1 = 0;      // parameters on the curve as given; t0 > t1 where the loop traverses it backwards; the
                              // curve's own knots may lie between them
  Eigen::Vector2d from{0, 0}, to{0, 0};
};

// The material of one cut cell: closed chains of pieces; the material lies left of each.
struct CutCell {
  int i = 0, j = 0;
  std::vector<std::vector<BoundaryPiece>> loops;
};

// How often each level of arithmetic decided.
struct PredicateCounts {
  std::int64_t coefficient_signs = 0, interval = 0, exact = 0, algebraic = 0;
};

//   (1) cells and vertices are classified by exact winding numbers; a cell is `cut` only where the trim meets its open
//       interior (a trim along its border leaves it inside or outside);
//   (2) every crossing, touch and passage through a knot vertex is one event, none twice; a run along a knot line
//       contributes its two ends and the knot vertices on it, as crossing_uv at vertices;
//   (3) the border of the domain counts as knot lines;
//   (4) the loops of a cut cell are closed bitwise and cover exactly its material.
struct TrimTopology {
  KnotMesh mesh;
  std::vector<TrimEvent> events;
  std::vector<CellKind> cells;       // mesh.cell(i,j)
  std::vector<VertexKind> vertices;  // mesh.vertex(i,j)
  std::vector<CutCell> cut_cells;    // ordered by mesh.cell
  TrimSpans spans;                   // the Bezier spans of the trims, about which all this was decided
  PredicateCounts counts;
};

// The trims must have passed validate_loops; throws GeometryError where they are found open, crossing or not nested.
// The knot lines are those of `surface.surface`.
TrimTopology trace_trims(const TrimmedSurface& surface);

// Is the parameter point in the material (border included)? Throws GeometryError where it isn't finite.
bool contains(const TrimmedSurface& surface, const TrimTopology& topology, const Eigen::Vector2d& uv);

}  // namespace toile
