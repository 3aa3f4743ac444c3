// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/build/pin_reach.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "geometry/error.h"
#include "pipeline/build/places.h"

namespace toile {
namespace {

// Material points that stand for what a pin holds.
std::vector<Eigen::Vector2d> marks(const Address& at, const NurbsSurface& rest) {
  const Interval u = rest.u().domain(), v = rest.v().domain();
  const auto end = [](const Interval& d, int e) { return e == 0 ? d.min : d.max; };
  if (at.kind == Address::Kind::uv || at.kind == Address::Kind::corner) return {point_uv(at, rest)};
  std::vector<Eigen::Vector2d> points;
  if (at.kind == Address::Kind::edge) {
    for (const double s : {0.0, 0.25, 0.5, 0.75, 1.0}) {
      points.emplace_back(at.a == 0 ? end(u, at.b) : u.min + s * u.length(),
                          at.a == 0 ? v.min + s * v.length() : end(v, at.b));
    }
  }
  return points;
}

// How far two material points of a flat panel can be apart [m]: along threads of weft and warp, which the limit lets
// stretch so far, from one to the other beside the straight line of the parameter plane. Infinite where that line
// leaves the material.
double reach(const Build& build, int panel, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const ClothPanel& cloth = build.model->panels()[static_cast<std::size_t>(panel)];
  const BuiltPanel& built = build.panels[static_cast<std::size_t>(panel)];
  const StrainLimit& limit = build.scene.strain_limit;
  constexpr int parts = 32;
  double sum = 0;
  for (int k = 0; k < parts; ++k) {
    const Eigen::Vector2d step = (to - from) / parts, middle = from + (k + 0.5) * step;
    if (!in_material(built.face, built.topology, middle)) return std::numeric_limits<double>::infinity();
    const SurfaceJet jet = evaluate(cloth.rest, middle.x(), middle.y());
    const Eigen::Vector3d normal = jet.u.cross(jet.v).normalized(), along = jet.u * step.x() + jet.v * step.y();
    const Eigen::Vector3d weft = Eigen::AngleAxisd(cloth.grain, normal) * *cloth.straight_u;
    const double weft_part = along.dot(weft), warp_part = (along - weft_part * weft).norm();
    sum +=
        std::abs(weft_part) * std::sqrt(1 + 2 * limit.weft.stretch) + warp_part * std::sqrt(1 + 2 * limit.warp.stretch);
  }
  return sum;
}

}  // namespace

void refuse_out_of_reach(const Build& build, double t, const MovedPoint& moved) {
  const Scene& scene = build.scene;
  if (!scene.strain_limit.on) return;
  constexpr int moments = 32;
  for (std::size_t a = 0; a < scene.pins.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const ScenePin &p = scene.pins[a], &q = scene.pins[b];
      if (p.panel != q.panel || !(p.move || q.move) || p.partial() || q.partial()) continue;
      const int panel = build.panel(p.panel);
      const ClothPanel& cloth = build.model->panels()[static_cast<std::size_t>(panel)];
      if (!cloth.straight_u) continue;
      double end = std::max(p.move ? p.move->end : 0, q.move ? q.move->end : 0);
      for (const ScenePin* pin : {&p, &q}) end = std::min(end, pin->release.value_or(end));
      end = std::min(end, scene.until);
      const NurbsSurface start = cloth.rest.with_points(build.net(panel, build.start));
      for (const Eigen::Vector2d& from : marks(p.at, cloth.rest)) {
        for (const Eigen::Vector2d& to : marks(q.at, cloth.rest)) {
          const double longest = reach(build, panel, from, to);
          for (int k = 1; k <= moments && t < end; ++k) {
            const double time = t + (end - t) * k / moments;
            const double apart = (moved(static_cast<int>(a), start(from.x(), from.y()), time) -
                                  moved(static_cast<int>(b), start(to.x(), to.y()), time))
                                     .norm();
            if (!(apart > longest * (1 + 1e-9))) continue;
            throw InputError(fmt::format(
                "{}: pins {} ({}) and {} ({}) are {:.4g} m apart at t = {:.3g} s, but the cloth between them reaches "
                "{:.4g} m within the strain limit",
                p.where, b, q.at.text, a, p.at.text, apart, time, longest));
          }
        }
      }
    }
  }
}

}  // namespace toile
