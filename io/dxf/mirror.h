// SPDX-License-Identifier: GPL-3.0-or-later
// Pieces drawn as one half of themselves, and pieces that are cut a second time, mirrored.
#pragma once

#include <optional>
#include <vector>

#include "io/dxf/drawing.h"
#include "io/outlines.h"

namespace toile::dxf {

// A line that a piece is folded at (layer 6).
struct Mirror {
  Eigen::Vector2d at, along;  // a point, the direction (a unit vector)
  Eigen::Vector2d operator()(const Eigen::Vector2d& p) const;
  double side(const Eigen::Vector2d& p) const;  // distance, positive on the left
};

std::optional<Mirror> mirror_of(const Item& item);

// The edges on the mirror line go, all others come a second time. A boundary that isn't drawn along the line, but ends
// on it twice, is unfolded too. False, and nothing done, where neither is so, or where it lies on both sides.
bool unfold(std::vector<LooseCurve>& curves, const Mirror& mirror, double tolerance);

PanelMark mirrored(const Mirror& mirror, PanelMark mark);

// The panel turned over: u becomes -u. Curves keep their numbers and run as they did.
TrimmedSurface mirrored(const TrimmedSurface& panel);

}  // namespace toile::dxf
