// SPDX-License-Identifier: GPL-3.0-or-later
// The nearest of some cells for every point of a grid.
#pragma once

#include <span>
#include <vector>

namespace toile {

struct NearestCell {
  int i = -1, j = -1;  // -1: no cell is marked
  double distance_squared = 0;
};

// For the points (x[i], y[j]), x and y ascending and in cells, the marked cell whose centre (a + 0.5, b + 0.5) is
// nearest, i fastest. Of equally near ones that in the innermost ring of cells around the point's own, then the lowest
// b, then the lowest a. `marked` is nu x nv, first index fastest.
//   cost: x.size() * (nv + y.size()) * log(y.size()), whatever is marked.
std::vector<NearestCell> nearest_cells(int nu, int nv, std::span<const char> marked, std::span<const double> x,
                                       std::span<const double> y);

}  // namespace toile
