#include "analysis/projection/point_rule.h"

#include <algorithm>
#include <cmath>

namespace toile {
namespace {

// Greville abscissae that no knot line stands for, counted by span, then spread evenly over their span. Each knot line
// in turn takes the nearest one left, measured in spans.
std::vector<double> border_lines(const KnotVector& knots, bool closed) {
  const std::vector<double> breaks = knots.breaks();
  std::vector<double> lines;
  if (knots.degree() <= 2) {
    for (std::size_t k = 1; k + 1 < breaks.size(); ++k)
      if (knots.multiplicity(breaks[k]) >= knots.degree()) lines.push_back(0.5 * (breaks[k - 1] + breaks[k]));
    if (closed) lines.push_back(0.5 * (breaks[breaks.size() - 2] + breaks.back()));
    return lines;
  }
  const auto cell_of = [&](double u) {
    return static_cast<std::size_t>(std::upper_bound(breaks.begin() + 1, breaks.end() - 1, u) - breaks.begin() - 1);
  };
  std::vector<double> left;  // in spans
  for (int i = 0; i < knots.control_point_count(); ++i) {
    const double u = std::clamp(knots.greville(i), breaks.front(), breaks.back());
    const std::size_t c = cell_of(u);
    left.push_back(static_cast<double>(c) + (u - breaks[c]) / (breaks[c + 1] - breaks[c]));
  }
  for (std::size_t k = 0; k < breaks.size() && !left.empty(); ++k) {
    const auto distance = [&](double x) { return std::abs(x - static_cast<double>(k)); };
    left.erase(std::ranges::min_element(left, {}, distance));
  }
  std::vector<int> extra(breaks.size() - 1, 0);
  for (const double x : left) ++extra[std::min(static_cast<std::size_t>(x), breaks.size() - 2)];
  for (std::size_t c = 0; c < extra.size(); ++c)
    for (int k = 1; k <= extra[c]; ++k) lines.push_back(breaks[c] + (breaks[c + 1] - breaks[c]) * k / (extra[c] + 1));
  return lines;
}

std::vector<double> middles(const KnotVector& knots) {
  const std::vector<double> breaks = knots.breaks();
  std::vector<double> lines;
  for (std::size_t c = 0; c + 1 < breaks.size(); ++c) lines.push_back(0.5 * (breaks[c] + breaks[c + 1]));
  return lines;
}

struct Line {
  double at = 0;
  bool knot = false;
};
std::vector<Line> merged(const std::vector<double>& breaks, const std::vector<double>& extra) {
  std::vector<Line> lines;
  for (const double u : breaks) lines.push_back({u, true});
  for (const double u : extra) lines.push_back({u, false});
  std::ranges::sort(lines, {}, &Line::at);
  return lines;
}

}  // namespace

std::vector<ConstraintPoint> points_for_degree(const TrimmedSurface& surface, const TrimTopology& topology,
                                               PointRule rule, const Closure& closure) {
  const KnotVector& u = surface.surface.u();
  const KnotVector& v = surface.surface.v();
  std::vector<ConstraintPoint> points;
  if (rule == PointRule::knot_mesh) return points;
  const auto extra = [&](const KnotVector& knots, bool closed) {
    return rule == PointRule::border ? border_lines(knots, closed) : middles(knots);
  };
  const std::vector<Line> lines_u = merged(topology.mesh.u, extra(u, closure.u)),
                          lines_v = merged(topology.mesh.v, extra(v, closure.v));
  for (const Line& b : lines_v)
    for (const Line& a : lines_u) {
      if (a.knot && b.knot) continue;
      if (rule == PointRule::cells && (a.knot || b.knot)) continue;
      if (!contains(surface, topology, {a.at, b.at})) continue;
      ConstraintPoint point;
      point.u = a.at;
      point.v = b.at;
      points.push_back(point);
    }
  return points;
}

void merge_over_seams(const NurbsSurface& surface, const Closure& closure, std::vector<ConstraintPoint>& points,
                      double distance) {
  for (const Direction d : {Direction::u, Direction::v}) {
    if (!closure.in(d)) continue;
    const bool is_u = d == Direction::u;
    const Interval domain = surface.knots(d).domain();
    const KnotVector& along = surface.knots(is_u ? Direction::v : Direction::u);
    const auto across_of = [&](const ConstraintPoint& p) { return is_u ? p.u : p.v; };
    const auto along_of = [&](const ConstraintPoint& p) { return is_u ? p.v : p.u; };
    std::vector<double> first;  // places along the seam that the domain's start lists
    for (const ConstraintPoint& p : points)
      if (p.used && across_of(p) == domain.min) first.push_back(along_of(p));
    std::ranges::sort(first);
    for (ConstraintPoint& p : points) {
      if (!p.used || across_of(p) != domain.max) continue;
      const int span = along.find_span(along_of(p));
      const double near = distance * (along[span + 1] - along[span]);
      const auto twin = std::ranges::lower_bound(first, along_of(p) - near);
      if (twin == first.end() || *twin > along_of(p) + near) continue;
      p.used = false;
      p.why = "merged";
    }
  }
}

}  // namespace toile
