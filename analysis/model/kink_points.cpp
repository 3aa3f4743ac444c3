// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/model/kink_points.h"

#include <algorithm>

#include "trimming/gauss.h"

namespace toile {
namespace {

// How far beside the line its two sides are looked at, of a cell. A trim along the line leaves material on one side.
constexpr double beside = 1e-6;

}  // namespace

std::vector<KinkPoint> kink_points(const TrimmedSurface& surface, const TrimTopology& topology,
                                   const Closure& closure) {
  std::vector<KinkPoint> points;
  for (const Direction d : {Direction::u, Direction::v}) {
    const bool is_u = d == Direction::u;
    const KnotVector& knots = surface.surface.knots(d);
    const std::vector<double>& lines = is_u ? topology.mesh.u : topology.mesh.v;
    const std::vector<double>& across = is_u ? topology.mesh.v : topology.mesh.u;
    const GaussRule& rule = gauss_rule(surface.surface.knots(is_u ? Direction::v : Direction::u).degree() + 1);
    const std::size_t last = lines.size() - 1;
    for (std::size_t k = closure.in(d) ? 0 : 1; k < last; ++k) {
      const bool seam = k == 0;
      if (!seam && knots.multiplicity(lines[k]) < knots.degree()) continue;
      std::vector<double> ends = across;
      for (const TrimEvent& event : topology.events) {
        const int line = is_u ? event.line_u : event.line_v;
        if (line == static_cast<int>(k) || (seam && line == static_cast<int>(last)))
          ends.push_back(event.uv[is_u ? 1 : 0]);
      }
      std::ranges::sort(ends);
      const std::size_t from = seam ? last : k;
      const double before = lines[from] - beside * (lines[from] - lines[from - 1]);
      const double after = lines[k] + beside * (lines[k + 1] - lines[k]);
      for (std::size_t e = 0; e + 1 < ends.size(); ++e) {
        const double middle = 0.5 * (ends[e] + ends[e + 1]);
        if (!(ends[e] < middle && middle < ends[e + 1])) continue;
        const auto in = [&](double side) {
          return contains(surface, topology, is_u ? Eigen::Vector2d(side, middle) : Eigen::Vector2d(middle, side));
        };
        if (!in(before) || !in(after)) continue;
        for (int g = 0; g < rule.size(); ++g) {
          const double half = 0.5 * (ends[e + 1] - ends[e]);
          const std::size_t at = static_cast<std::size_t>(g);
          points.push_back({d, lines[k], middle + half * rule.x[at], half * rule.w[at]});
        }
      }
    }
  }
  return points;
}

void drop_strips(const NurbsSurface& surface, const SmoothSeams& seams, std::vector<KinkPoint>& kinks) {
  std::erase_if(kinks, [&](const KinkPoint& point) {
    return point.at == surface.knots(point.direction).domain().min && seams.at(surface, point.direction, point.along);
  });
}

}  // namespace toile
