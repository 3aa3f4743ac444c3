// SPDX-License-Identifier: GPL-3.0-or-later
// The boundary of a cut cell's material as Bezier pieces in coordinates of its own, for integrals and triangles that
// stay exact relative to the material however small it is.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "trimming/topology.h"

namespace toile {

// A (rational) Bezier piece over [0, 1] with the material on its left: homogeneous control points (w x, w y, w), x and
// y counted from CellBoundary::origin. Extended precision: a sliver 1e-10 of a cell wide, cut off by a curve whose
// control points lie cells away, still has nine good digits of width.
struct BoundaryBezier {
  using Real = long double;
  int degree = 1;
  bool rational = false;
  bool trim = false;  // a piece of a trim curve; else of the cell's border
  std::array<Real, max_degree + 1> x{}, y{}, w{};
};

struct CellBoundary {
  Eigen::Vector2d origin{0, 0};        // a vertex of the material, exact
  Interval u, v;                       // the cell
  std::vector<BoundaryBezier> pieces;  // chain after chain, closed: each starts bitwise where its predecessor ends
  std::vector<int> chain_ends;         // index of the first piece after each chain
};
// Appends the pieces of one part of the boundary, in its direction, coordinates from `origin`. Weights of a piece
// differ by less than a factor of 4.
void append_pieces(const TrimmedSurface& surface, const BoundaryPiece& piece, const Eigen::Vector2d& origin,
                   std::vector<BoundaryBezier>& out);
void build_boundary(const TrimmedSurface& surface, const KnotMesh& mesh, const CutCell& cell, CellBoundary& out);

// Point and derivative of the Euclidean piece at t.
struct BoundaryJet {
  BoundaryBezier::Real x, y, dx, dy;
};
BoundaryJet evaluate(const BoundaryBezier& piece, BoundaryBezier::Real t);

// A rectangle that holds the material, not much larger than it: (x, y) = centre + half * (xi, eta), xi and eta in [-1,
// 1].
struct BoundaryBox {
  BoundaryBezier::Real centre_x = 0, centre_y = 0, half_x = 0, half_y = 0;
};
BoundaryBox box_of(const CellBoundary& boundary);

// The same pieces in the coordinates of the box.
void scale_to_box(CellBoundary& boundary, const BoundaryBox& box);

// Moments of the material in coordinates of [-1, 1]^2: entry a + (degree_x + 1) b is the integral of P_a(x) P_b(y), P
// Legendre, by Green's theorem along the pieces: exact for polynomial pieces, to rounding for rational ones.
void legendre_moments(std::span<const BoundaryBezier> pieces, int degree_x, int degree_y,
                      std::vector<BoundaryBezier::Real>& moments);

// Area of the material in the parameter plane.
double material_area(const TrimmedSurface& surface, const KnotMesh& mesh, const CutCell& cell);

}  // namespace toile
