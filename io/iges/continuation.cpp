// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/continuation.h"

#include <algorithm>
#include <vector>

#include "geometry/continuation.h"
#include "io/iges/parameter_reading.h"

namespace toile::iges {

namespace {

using Eigen::Vector2d;

constexpr double least_gap = 1e-9, most_gap = 0.1;  // of the domain

// How far places lie beyond the domain, as a part of it; closed directions have no beyond.
double beyond(const FacePlane& plane, const Vector2d& x) {
  double out = 0;
  for (int k = 0; k < 2; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (plane.closed[i]) continue;
    out = std::max({out, (plane.domain[i].min - x[k]) / plane.domain[i].length(),
                    (x[k] - plane.domain[i].max) / plane.domain[i].length()});
  }
  return out;
}

// Places on a span, closer and closer to its ends: a curve that starts on the border may leave it there alone.
const std::vector<double>& places() {
  static const std::vector<double> all = [] {
    std::vector<double> out{0, 1};
    for (int k = 1; k < 16; ++k) out.push_back(k / 16.0);
    for (double near = 1.0 / 32; near > 1e-9; near /= 2) out.insert(out.end(), {near, 1 - near});
    return out;
  }();
  return all;
}

// How far a curve itself goes, at places on it, and the box that holds all of it.
struct Reach {
  double beyond = 0;
  Eigen::AlignedBox2d box;
};
void add(const FacePlane& plane, const ParameterMap& map, const Curve3& c, Reach& reach) {
  for (const int span : c.knots().spans())
    for (const double s : places()) {
      const double t = c.knots()[span] + (c.knots()[span + 1] - c.knots()[span]) * s;
      reach.beyond = std::max(reach.beyond, beyond(plane, map(c(t).head<2>())));
    }
  for (const auto& p : c.points().colwise()) reach.box.extend(map(p.head<2>()));
}

}  // namespace

std::optional<FileSurface> continued_surface(const FileSurface& surface, const std::vector<BoundaryCurves>& boundaries,
                                             const FaceOptions& options, double& by) {
  if (surface.plane) return std::nullopt;
  FaceOptions quiet = options;
  quiet.note = [](const std::string&, const std::string&) {};
  const FacePlane plane(surface, quiet);
  const ParameterMap& map = best_map(plane, boundaries);
  Reach reach;
  const std::size_t count = options.outer_known ? 1 : boundaries.size();
  for (std::size_t i = 0; i < count; ++i) {
    Reach one;
    for (const Curve3& c : boundaries[i].parameter) add(plane, map, c, one);
    if (boundaries[i].model.empty() && one.beyond > usable) return std::nullopt;
    reach.beyond = std::max(reach.beyond, one.beyond);
    reach.box.extend(one.box);
  }
  if (!(reach.beyond > least_gap) || !(beyond(plane, reach.box.min()) <= most_gap) ||
      !(beyond(plane, reach.box.max()) <= most_gap))
    return std::nullopt;
  FileSurface out = surface;
  for (int k = 0; k < 2; ++k) {
    if (plane.closed[static_cast<std::size_t>(k)]) continue;
    std::optional<NurbsSurface> wider =
        continued(out.surface, k == 0 ? Direction::u : Direction::v, {reach.box.min()[k], reach.box.max()[k]});
    if (!wider) return std::nullopt;
    out.surface = std::move(*wider);
  }
  const FacePlane wide(out, quiet);
  for (std::size_t i = 0; i < count; ++i)
    if (!boundaries[i].model.empty() && !(disagreement(wide, boundaries[i], map) <= agreed(plane))) return std::nullopt;
  by = reach.beyond;
  return out;
}

}  // namespace toile::iges
