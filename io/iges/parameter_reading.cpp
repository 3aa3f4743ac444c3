// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/parameter_reading.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "geometry/measure.h"

namespace toile::iges {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// How far the boundaries' parameter curves lie from their model curves; nothing where no boundary has both.
std::optional<double> disagreement(const FacePlane& plane, const std::vector<BoundaryCurves>& boundaries,
                                   const ParameterMap& map) {
  std::optional<double> off;
  for (const BoundaryCurves& b : boundaries)
    if (!b.parameter.empty() && !b.model.empty())
      off = std::max(off.value_or(0), toile::iges::disagreement(plane, b, map));
  return off;
}

// How far the ends of the parameter curves leave the domain, relative to it.
double excursion(const FacePlane& plane, const std::vector<BoundaryCurves>& boundaries, const ParameterMap& map) {
  double largest = 0;
  for (const BoundaryCurves& b : boundaries)
    for (const Curve3& c : b.parameter)
      for (const Vector3d& end : {c.start(), c.end()}) {
        const Vector2d x = map(end.head<2>());
        for (int k = 0; k < 2; ++k) {
          const Interval& d = plane.domain[static_cast<std::size_t>(k)];
          if (plane.closed[static_cast<std::size_t>(k)]) continue;
          largest = std::max({largest, (d.min - x[k]) / d.length(), (x[k] - d.max) / d.length()});
        }
      }
  return largest;
}

const ParameterMap& nearest_to_model_curves(const FacePlane& plane, const std::vector<BoundaryCurves>& boundaries,
                                            double least) {
  const std::vector<ParameterMap>& maps = plane.file.maps;
  if (least <= std::max(plane.options.resolution, 1e-6 * plane.size)) return maps[0];
  const ParameterMap* best = &maps[0];
  for (const ParameterMap& map : maps)
    if (const double off = *disagreement(plane, boundaries, map); off < (1 - 1e-6) * least) {
      least = off;
      best = &map;
    }
  return least <= agreed(plane) || plane.file.degrees_or_radians ? *best : maps[0];
}

}  // namespace

Vector3d point_at(const FacePlane& plane, Vector2d uv) {
  for (int k = 0; k < 2; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (!plane.closed[i] || plane.domain[i].contains(uv[k])) continue;
    uv[k] -= plane.period[i] * std::floor((uv[k] - plane.domain[i].min) / plane.period[i]);
    uv[k] = std::clamp(uv[k], plane.domain[i].min, plane.domain[i].max);
  }
  return plane.surface(uv.x(), uv.y());
}

double agreed(const FacePlane& plane) {
  return std::max(10 * plane.options.resolution, 1e-4 * plane.size);
}

double disagreement(const FacePlane& plane, const BoundaryCurves& b, const ParameterMap& map) {
  double largest = 0;
  const auto image = [&](const Curve3& c, double f) {
    return point_at(plane, map(c(c.domain().min + f * c.domain().length()).head<2>()));
  };
  for (std::size_t i = 0; i < b.parameter.size(); ++i) {
    const Curve3& c = b.parameter[i];
    const Vector3d start = image(c, 0), middle = image(c, 0.5), end = image(c, 1);
    if (b.parameter.size() == b.model.size()) {
      const Curve3& m = b.model[i];
      largest = std::max(largest, std::min(std::max((start - m.start()).norm(), (end - m.end()).norm()),
                                           std::max((start - m.end()).norm(), (end - m.start()).norm())));
      if ((middle - m(0.5 * (m.domain().min + m.domain().max))).norm() > agreed(plane))
        largest = std::max(largest, closest_point(m, middle).distance);
      continue;
    }
    for (const Vector3d& x : {start, middle}) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const Curve3& m : b.model) nearest = std::min(nearest, closest_point(m, x).distance);
      largest = std::max(largest, nearest);
    }
  }
  return largest;
}

const ParameterMap& best_map(const FacePlane& plane, const std::vector<BoundaryCurves>& boundaries) {
  const std::vector<ParameterMap>& maps = plane.file.maps;
  if (maps.size() == 1 || boundaries.empty()) return maps[0];
  const std::optional<double> standard = disagreement(plane, boundaries, maps[0]);
  if (!standard && plane.file.degrees_or_radians) {
    // Angles that stay within a turn of radians are radians.
    double widest = 0;
    for (const BoundaryCurves& b : boundaries)
      for (const Curve3& c : b.parameter) widest = std::max({widest, std::abs(c.start().x()), std::abs(c.end().x())});
    return widest > 6.3 ? maps[0] : maps[1];
  }
  const ParameterMap* best = &maps[0];
  if (standard) {
    best = &nearest_to_model_curves(plane, boundaries, *standard);
  } else {
    const auto inside =
        std::ranges::find_if(maps, [&](const ParameterMap& m) { return excursion(plane, boundaries, m) <= usable; });
    if (inside != maps.end()) best = &*inside;
  }
  if (best != &maps[0] && !plane.file.degrees_or_radians)
    plane.note(boundaries[0], "other reading",
               std::string("its parameter curves don't count as the standard says; a reading under which they ") +
                   (standard ? "lie on its model curves" : "stay within the surface") + " is taken");
  return *best;
}

}  // namespace toile::iges
