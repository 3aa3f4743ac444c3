// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/dxf/mirror.h"

#include <cmath>

#include "geometry/refine.h"
#include "io/dxf/curves.h"
#include "io/flat_panel.h"

namespace toile::dxf {

namespace {

using Eigen::Vector2d;

Curve3 image(const Mirror& mirror, const Curve3& curve) {
  Eigen::Matrix3Xd points = curve.points();
  for (Eigen::Index k = 0; k < points.cols(); ++k) points.col(k).head<2>() = mirror(points.col(k).head<2>());
  return Curve3(curve.knots(), std::move(points), curve.weights());
}

Curve2 image(const Mirror& mirror, const Curve2& curve) {
  Curve2::Points points = curve.points();
  for (Eigen::Index k = 0; k < points.cols(); ++k) points.col(k) = mirror(points.col(k));
  return Curve2(curve.knots(), std::move(points), curve.weights());
}

}  // namespace

Vector2d Mirror::operator()(const Vector2d& p) const {
  return at + 2 * along.dot(p - at) * along - (p - at);
}

double Mirror::side(const Vector2d& p) const {
  return along.x() * (p - at).y() - along.y() * (p - at).x();
}

std::optional<Mirror> mirror_of(const Item& item) {
  if (item.layer != "6" || item.point) return std::nullopt;
  const std::vector<Curve3> curves = curves_of(item, {});
  if (curves.size() != 1 || curves[0].degree() != 1 || curves[0].points().cols() != 2) return std::nullopt;
  const Vector2d a = curves[0].start().head<2>(), b = curves[0].end().head<2>();
  if (a == b) return std::nullopt;
  return Mirror{a, (b - a).normalized()};
}

bool unfold(std::vector<LooseCurve>& curves, const Mirror& mirror, double tolerance) {
  bool left = false, right = false, edge = false;
  int ends = 0;
  const auto on_line = [&](const Curve3& c) {
    bool on = true;
    for (Eigen::Index k = 0; k < c.points().cols(); ++k)
      on = on && std::abs(mirror.side(c.points().col(k).head<2>())) <= tolerance;
    return on;
  };
  for (const LooseCurve& loose : curves) {
    for (const Curve3& c : loose.pieces) {
      edge = edge || on_line(c);
      for (const Eigen::Vector3d& p : {c.start(), c.end()}) ends += std::abs(mirror.side(p.head<2>())) <= tolerance;
      for (Eigen::Index k = 0; k < c.points().cols(); ++k) {
        left = left || mirror.side(c.points().col(k).head<2>()) > 10 * tolerance;
        right = right || mirror.side(c.points().col(k).head<2>()) < -10 * tolerance;
      }
    }
  }
  // Where the edge on the line is missing just two ends lie there; at a corner of the piece four would.
  if (left == right || !(edge || ends == 2)) return false;
  for (LooseCurve& loose : curves) std::erase_if(loose.pieces, on_line);
  const std::size_t drawn = curves.size();
  for (std::size_t k = 0; k < drawn; ++k) {
    LooseCurve other = curves[k];
    for (Curve3& c : other.pieces) c = image(mirror, c);
    curves.push_back(std::move(other));
  }
  return true;
}

PanelMark mirrored(const Mirror& mirror, PanelMark mark) {
  mark.at = mirror(mark.at);
  if (mark.curve) mark.curve = image(mirror, *mark.curve);
  return mark;
}

TrimmedSurface mirrored(const TrimmedSurface& panel) {
  const Mirror axis{{0, 0}, {0, 1}};
  std::vector<std::vector<TrimCurve>> loops;
  for (const TrimLoop& loop : panel.loops) {
    loops.emplace_back(loop.curves);
    for (TrimCurve& trim : loops.back()) trim.curve = image(axis, trim.curve);
  }
  const Interval u = panel.surface.u().domain(), v = panel.surface.v().domain();
  // Pieces lie in planes of constant z.
  const double z = panel.surface(u.min, v.min).z();
  TrimmedSurface out = flat_panel(std::move(loops), {{0, 0, z}, {1, 0, 0}, {0, 1, 0}, 0});
  out.name = panel.name;
  out.metres_per_unit = panel.metres_per_unit;
  out.resolution = panel.resolution;
  out.source = panel.source;
  for (const PanelMark& mark : panel.marks) out.marks.push_back(mirrored(axis, mark));
  return out;
}

}  // namespace toile::dxf
