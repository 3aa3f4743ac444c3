// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/constraint_points.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <set>
#include <span>
#include <utility>

#include "trimming/loops.h"

namespace toile {
namespace {

// A turn below this is none: borders of other programs are polygons that stand for curves.
const double least_turn = std::numbers::pi / 6;

// A Bezier span as a loop runs along it.
struct Passed {
  const TrimSpan* span = nullptr;
  bool backwards = false;
  double start() const { return backwards ? span->range.max : span->range.min; }
  double end() const { return backwards ? span->range.min : span->range.max; }
  Eigen::Vector2d point(int i) const { return span->point(backwards ? span->degree - i : i); }
};

std::vector<Passed> passed_spans(const TrimmedSurface& surface, const TrimTopology& topology, int loop) {
  const std::vector<TrimCurve>& curves = surface.loops[static_cast<std::size_t>(loop)].curves;
  std::vector<Passed> out;
  for (std::size_t c = 0; c < curves.size(); ++c) {
    const std::span<const TrimSpan> spans = topology.spans.of(loop, static_cast<int>(c));
    for (std::size_t k = 0; k < spans.size(); ++k) {
      const TrimSpan& span = spans[curves[c].reversed ? spans.size() - 1 - k : k];
      if (!span.degenerate()) out.push_back({&span, curves[c].reversed});
    }
  }
  return out;
}

// In the parameter plane, of any length: towards the first control point that isn't the end.
Eigen::Vector2d leaving(const Passed& p) {
  int i = 1;
  while (p.point(i) == p.point(0)) ++i;
  return p.point(i) - p.point(0);
}
Eigen::Vector2d arriving(const Passed& p) {
  int i = p.span->degree - 1;
  while (p.point(i) == p.point(p.span->degree)) --i;
  return p.point(p.span->degree) - p.point(i);
}

bool turns(const NurbsSurface& surface, const Eigen::Vector2d& uv, const Eigen::Vector2d& in,
           const Eigen::Vector2d& out) {
  const SurfaceJet jet = evaluate(surface, uv.x(), uv.y());
  const Eigen::Vector3d a = jet.u * in.x() + jet.v * in.y(), b = jet.u * out.x() + jet.v * out.y();
  return std::atan2(a.cross(b).norm(), a.dot(b)) > least_turn;  // 0 where the surface stands still
}

}  // namespace

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
  for (std::size_t l = 0; l < surface.loops.size() && !surface.natural_bounds; ++l) {
    const TrimLoop& loop = surface.loops[l];
    const std::vector<Passed> spans = passed_spans(surface, topology, static_cast<int>(l));
    for (std::size_t k = 0; k < spans.size(); ++k) {
      const Passed &before = spans[k > 0 ? k - 1 : spans.size() - 1], &after = spans[k];
      const Eigen::Vector2d uv = after.point(0);
      if (seen.contains({uv.x(), uv.y()}) || !turns(surface.surface, uv, arriving(before), leaving(after))) continue;
      const bool earlier = against_the_file(loop);
      ConstraintPoint point;
      point.kind = PointKind::corner;
      point.u = uv.x();
      point.v = uv.y();
      point.loop = loop.index;
      point.curve = loop.curves[static_cast<std::size_t>((earlier ? before : after).span->curve)].index;
      point.t = earlier ? before.end() : after.start();
      points.push_back(point);
    }
  }
  return points;
}

std::vector<ConstraintPoint> constraint_points(TrimmedSurface surface) {
  validate_loops(surface);
  return constraint_points(surface, trace_trims(surface));
}

}  // namespace toile
