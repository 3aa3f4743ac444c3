// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "geometry/finite.h"
#include "trimming/topology.h"
#include "trimming/winding.h"

namespace toile {
namespace {

// Cells [first, last] of one direction whose closure holds x; empty (first > last) outside the domain.
std::pair<int, int> cells_around(double x, const std::vector<double>& lines) {
  if (x < lines.front() || x > lines.back()) return {0, -1};
  const int above = static_cast<int>(std::upper_bound(lines.begin(), lines.end(), x) - lines.begin());
  const int below = static_cast<int>(std::lower_bound(lines.begin(), lines.end(), x) - lines.begin());
  return {std::max(below - 1, 0), std::min(above - 1, static_cast<int>(lines.size()) - 2)};
}

}  // namespace

bool contains(const TrimmedSurface& surface, const TrimTopology& topology, const Eigen::Vector2d& uv) {
  require_finite(uv, "the point asked about");
  const auto [i0, i1] = cells_around(uv.x(), topology.mesh.u);
  const auto [j0, j1] = cells_around(uv.y(), topology.mesh.v);
  bool cut = false;
  for (int j = j0; j <= j1; ++j) {
    for (int i = i0; i <= i1; ++i) {
      const CellKind kind = topology.cells[static_cast<std::size_t>(topology.mesh.cell(i, j))];
      if (kind == CellKind::inside) return true;
      cut = cut || kind == CellKind::cut;
    }
  }
  if (!cut) return false;
  PredicateCounts counts;
  int total = 0;
  for (std::size_t l = 0; l < surface.loops.size(); ++l) {
    const std::optional<int> winding = winding_number(surface.loops, topology.spans, static_cast<int>(l), uv, counts);
    if (!winding) return true;
    total += *winding;
  }
  return total == 1;
}

}  // namespace toile
