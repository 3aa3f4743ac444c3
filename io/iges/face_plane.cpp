// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/face_plane.h"

#include <algorithm>

#include "geometry/error.h"
#include "trimming/pull_back.h"

namespace toile::iges {

using Eigen::Vector2d;

FacePlane::FacePlane(const FileSurface& from, const FaceOptions& face_options)
    : file(from), surface(from.surface), options(face_options) {
  domain = {surface.u().domain(), surface.v().domain()};
  size = (surface.points().rowwise().maxCoeff() - surface.points().rowwise().minCoeff()).norm();
  snap = std::min(options.resolution, 1e-6 * size);
  closed = closed_directions(surface, std::max(snap, 1e-9 * size));
  for (std::size_t k = 0; k < 2; ++k) period[k] = closed[k] ? domain[k].length() : 0;
}

void FacePlane::fail(const BoundaryCurves& b, const std::string& what) const {
  throw GeometryError(b.place + what);
}

void FacePlane::note(const BoundaryCurves& b, const std::string& kind, const std::string& what) const {
  options.note(kind, b.place + what);
}

Vector2d first(const TrimCurve& c) {
  return c.reversed ? c.curve.end() : c.curve.start();
}
Vector2d last(const TrimCurve& c) {
  return c.reversed ? c.curve.start() : c.curve.end();
}

void shift(TrimCurve& c, int k, double by) {
  if (by == 0) return;
  Curve2::Points points = c.curve.points();
  points.row(k).array() += by;
  c.curve = Curve2(c.curve.knots(), std::move(points), c.curve.weights());
}

TrimCurve leg(const Vector2d& a, const Vector2d& b, int index) {
  TrimCurve c;
  c.curve = line_segment<2>(a, b);
  c.index = index;
  return c;
}

std::vector<Vector2d> polygon(const std::vector<TrimCurve>& curves) {
  std::vector<Vector2d> out;
  for (const TrimCurve& c : curves) {
    const std::size_t begin = out.size();
    for (const int i : c.curve.knots().spans()) {
      const double a = c.curve.knots()[i], b = c.curve.knots()[i + 1];
      const int pieces = c.curve.degree() == 1 ? 1 : 12;
      for (int k = 0; k < pieces; ++k) out.push_back(c.curve(a + (b - a) * k / pieces));
    }
    out.push_back(c.curve.end());
    if (c.reversed) std::reverse(out.begin() + static_cast<std::ptrdiff_t>(begin), out.end());
  }
  return out;
}

}  // namespace toile::iges
