// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/constraint_points.h"

#include <set>
#include <utility>

#include "trimming/loops.h"

namespace toile {

std::vector<ConstraintPoint> constraint_points(const TrimmedSurface& surface, const TrimTopology& topology) {
  const KnotMesh& mesh = topology.mesh;
  std::vector<ConstraintPoint> points;
  std::set<std::pair<double, double>> seen;
  for (int j = 0; j <= mesh.cells_v(); ++j) {
    for (int i = 0; i <= mesh.cells_u(); ++i) {
      const VertexKind kind = topology.vertices[static_cast<std::size_t>(mesh.vertex(i, j))];
      if (kind != VertexKind::inside) continue;
      ConstraintPoint point;
      point.u = mesh.u[static_cast<std::size_t>(i)];
      point.v = mesh.v[static_cast<std::size_t>(j)];
      points.push_back(point);
    }
  }
  for (const TrimEvent& event : topology.events) {
    if (!seen.insert({event.uv.x(), event.uv.y()}).second) continue;
    const TrimLoop& loop = surface.loops[static_cast<std::size_t>(event.loop)];
    ConstraintPoint point;
    point.kind = surface.natural_bounds ? PointKind::vertex : event.kind;
    point.u = event.uv.x();
    point.v = event.uv.y();
    point.loop = loop.index;
    point.curve = loop.curves[static_cast<std::size_t>(event.curve)].index;
    point.t = event.t;
    points.push_back(point);
  }
  return points;
}

std::vector<ConstraintPoint> constraint_points(TrimmedSurface surface) {
  validate_loops(surface);
  return constraint_points(surface, trace_trims(surface));
}

}  // namespace toile
