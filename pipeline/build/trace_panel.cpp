// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/build/trace_panel.h"

#include <algorithm>
#include <utility>

#include "analysis/model/kink_points.h"
#include "geometry/error.h"
#include "geometry/measure.h"

namespace toile {
namespace {

// Of the directions in which the surface's edges meet, those with cloth on both sides of the seam.
Closure glued_seams(const TrimmedSurface& face, const TrimTopology& topology) {
  const Closure ends = find_closure(face.surface, same_place(face.resolution, face.surface));
  Closure glued;
  if (!ends.u && !ends.v) return glued;
  for (const KinkPoint& point : kink_points(face, topology, ends)) {
    if (point.at != face.surface.knots(point.direction).domain().min) continue;
    (point.direction == Direction::u ? glued.u : glued.v) = true;
  }
  return glued;
}

}  // namespace

double same_place(double resolution, const NurbsSurface& surface) {
  return std::max(resolution, 1e-9 * bounding_box(surface).diagonal().norm());
}

NurbsSurface refined(const TrimmedSurface& face, RefineOptions asked, const std::string& who) {
  NurbsSurface surface = face.surface;
  if (!surface.u().clamped() || !surface.v().clamped()) surface = clamp(surface);
  if (!asked.degree && !asked.span && !asked.spans && !asked.control_points) return surface;
  asked.tolerance = same_place(face.resolution, surface);
  try {
    return refine(surface, asked).surface;
  } catch (const GeometryError& error) {
    throw GeometryError(who + ": " + error.what());
  }
}

PanelTrace trace_panel(TrimmedSurface face, PointRule sampling) {
  PanelTrace out;
  out.face = std::move(face);
  out.repairs = validate_loops(out.face);
  out.topology = trace_trims(out.face);
  out.closure = glued_seams(out.face, out.topology);
  out.face.surface = close_exactly(out.face.surface, out.closure);
  out.leader = seam_leaders(out.face.surface, out.closure);
  out.points = constraint_points(out.face, out.topology);
  out.extra_points = apply_rule(sampling, out.face, out.topology, out.points, out.closure);
  for (auto* points : {&out.points, &out.extra_points}) merge_over_seams(out.face.surface, out.closure, *points);
  return out;
}

}  // namespace toile
