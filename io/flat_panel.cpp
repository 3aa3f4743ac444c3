// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/flat_panel.h"

#include <algorithm>

#include "geometry/error.h"
#include "geometry/text.h"

namespace toile {

TrimmedSurface flat_panel(std::vector<std::vector<TrimCurve>> loops, const AffinePatch& plane) {
  if (loops.empty() || loops[0].empty()) throw GeometryError("the outline has no curve");
  Eigen::Vector2d low = loops[0][0].curve.points().col(0), high = low;
  for (const TrimCurve& trim : loops[0]) {
    low = low.cwiseMin(trim.curve.points().rowwise().minCoeff());
    high = high.cwiseMax(trim.curve.points().rowwise().maxCoeff());
  }
  if (!((high - low).minCoeff() > 0))
    throw GeometryError("the outline is " + text((high - low).x()) + " wide and " + text((high - low).y()) +
                        " high, both must be positive");
  TrimmedSurface face;
  face.surface = rebuild(plane, uniform_knots(2, 1, {low.x(), high.x()}), uniform_knots(2, 1, {low.y(), high.y()}));
  for (std::size_t k = 0; k < loops.size(); ++k) {
    TrimLoop loop;
    loop.kind = k == 0 ? LoopKind::outer : LoopKind::hole;
    loop.index = static_cast<int>(k);
    loop.curves = std::move(loops[k]);
    for (std::size_t i = 0; i < loop.curves.size(); ++i) {
      const TrimCurve& next = loop.curves[(i + 1) % loop.curves.size()];
      loop.gap = std::max(loop.gap, (next.curve.start() - loop.curves[i].curve.end()).norm());
    }
    face.loops.push_back(std::move(loop));
  }
  return face;
}

Curve2 polyline_curve(const std::vector<Eigen::Vector2d>& points) {
  Curve2::Points p(2, static_cast<Eigen::Index>(points.size()));
  std::vector<double> knots{0};
  for (std::size_t k = 0; k < points.size(); ++k) {
    p.col(static_cast<Eigen::Index>(k)) = points[k];
    knots.push_back(static_cast<double>(k));
  }
  knots.push_back(static_cast<double>(points.size()) - 1);
  return Curve2(KnotVector(1, std::move(knots)), std::move(p));
}

double polygon_area(const std::vector<TrimCurve>& loop) {
  double twice = 0;
  for (const TrimCurve& trim : loop) {
    const Curve2::Points& p = trim.curve.points();
    double sum = 0;
    for (Eigen::Index i = 0; i + 1 < p.cols(); ++i) sum += p(0, i) * p(1, i + 1) - p(1, i) * p(0, i + 1);
    twice += sum;
  }
  return twice / 2;
}

}  // namespace toile
