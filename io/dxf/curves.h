// SPDX-License-Identifier: GPL-3.0-or-later
// Items of a piece as curves: where a polyline is several curves, so that seams and pins can name them.
#pragma once

#include <vector>

#include "io/dxf/drawing.h"

namespace toile::dxf {

// Where polylines are cut into curves.
struct Corners {
  std::vector<Eigen::Vector2d> turn_points;  // of the piece, layer 2; closed polylines are cut there and nowhere else
  double closed_angle = 20;                  // degrees: closed polylines without turn points are cut at sharper turns
  double open_angle = 180;                   // open ones, which end at corners, at sharper ones only
  double near = 0;                           // a turn point this near to a vertex is one
};

// Tangents of a quarter of an arc's angle that are beyond this, or no number, are drawn straight: such an arc is a full
// circle but for rounding, and as large as its bulge.
inline constexpr double largest_bulge = 1e6;

// Arcs where a polyline bulges, polylines between corners. A closed polyline starts at its first corner, so that no
// curve is cut where the file happens to begin.
std::vector<Curve3> curves_of(const Item& item, const Corners& corners);

}  // namespace toile::dxf
