// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/trimmed_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace toile {

std::string name(MarkKind kind) {
  switch (kind) {
    case MarkKind::grain:
      return "grain";
    case MarkKind::notch:
      return "notch";
    case MarkKind::drill:
      return "drill";
    case MarkKind::line:
      return "line";
    case MarkKind::text:
      return "text";
    case MarkKind::sew:
      return "sew";
    case MarkKind::slit:
      return "slit";
  }
  return {};
}

TrimLoop natural_loop(const NurbsSurface& surface) {
  const Interval u = surface.u().domain(), v = surface.v().domain();
  const Eigen::Vector2d corners[] = {{u.min, v.min}, {u.max, v.min}, {u.max, v.max}, {u.min, v.max}};
  TrimLoop loop;
  for (int k = 0; k < 4; ++k) {
    TrimCurve curve;
    curve.curve = line_segment<2>(corners[k], corners[(k + 1) % 4]);
    curve.index = k;
    loop.curves.push_back(std::move(curve));
  }
  return loop;
}

TrimmedSurface untrimmed(NurbsSurface surface) {
  TrimmedSurface face;
  face.loops = {natural_loop(surface)};
  face.natural_bounds = true;
  face.surface = std::move(surface);
  return face;
}

std::optional<double> grain_angle(const TrimmedSurface& face) {
  const auto mark = std::ranges::find(face.marks, MarkKind::grain, &PanelMark::kind);
  if (mark == face.marks.end() || !mark->curve) return std::nullopt;
  const Eigen::Vector2d a = mark->curve->start(), b = mark->curve->end();
  const SurfaceJet jet = evaluate(face.surface, a.x(), a.y());
  const Eigen::Vector3d warp = jet.u * (b - a).x() + jet.v * (b - a).y();
  const Eigen::Vector3d across = jet.u.cross(jet.v).cross(jet.u).normalized();
  if (!(warp.norm() > 0)) return std::nullopt;
  // A quarter turn back from the warp; the grain has no sense, so half turns are the same.
  const Eigen::Vector2d w(warp.dot(jet.u.normalized()), warp.dot(across));
  double angle = std::atan2(-w.x(), w.y());
  if (angle <= -std::numbers::pi / 2) angle += std::numbers::pi;
  if (angle > std::numbers::pi / 2) angle -= std::numbers::pi;
  return angle == 0 ? 0.0 : angle;
}

}  // namespace toile
