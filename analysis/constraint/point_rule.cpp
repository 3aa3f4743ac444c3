// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/constraint/point_rule.h"

#include <algorithm>
#include <cmath>
#include <numbers>

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

// `count` Gauss points of every span.
std::vector<double> gauss_lines(const KnotVector& knots, int count) {
  const std::vector<double> breaks = knots.breaks();
  const double offset = count == 2 ? std::numbers::inv_sqrt3 / 2 : 0;
  std::vector<double> lines;
  for (std::size_t c = 0; c + 1 < breaks.size(); ++c)
    for (int k = 0; k < count; ++k)
      lines.push_back(breaks[c] + (0.5 + (2 * k - 1) * offset) * (breaks[c + 1] - breaks[c]));
  return lines;
}

// Lines that are knot lines but for rounding become so.
void snap(std::vector<double>& lines, const std::vector<double>& breaks) {
  constexpr double rounding = 1e-9;  // of a span
  for (double& u : lines) {
    const auto above = std::upper_bound(breaks.begin() + 1, breaks.end() - 1, u);
    const double width = *above - *(above - 1);
    for (const double knot : {*(above - 1), *above})
      if (std::abs(u - knot) <= rounding * width) u = knot;
  }
}

// Greville abscissae of the splines of degree p - `lower`. Where two meet, each for one side of a C0 line or of a seam,
// the earlier one is moved half of its way back.
std::vector<double> greville_lines(const KnotVector& knots, int lower, bool closed) {
  if (knots.degree() <= lower) return gauss_lines(knots, 1);  // of piecewise constants: the middle of every span
  const Interval domain = knots.domain();
  std::vector<double> lines;
  for (int i = lower; i < knots.control_point_count(); ++i) {
    double u = 0;
    for (int k = 1; k <= knots.degree() - lower; ++k) u += knots[i + k];
    lines.push_back(std::clamp(u / (knots.degree() - lower), domain.min, domain.max));
  }
  if (closed) lines.push_back(domain.max);
  snap(lines, knots.breaks());
  for (std::size_t k = 1; k + 1 < lines.size(); ++k)
    if (lines[k] == lines[k + 1]) lines[k] = 0.5 * (lines[k - 1] + lines[k]);
  return lines;
}

// The lines of a rule besides the knot lines.
std::vector<double> lines_of(PointRule rule, const KnotVector& knots, bool closed) {
  switch (rule) {
    case PointRule::border:
      return border_lines(knots, closed);
    case PointRule::greville:
      return greville_lines(knots, 0, closed);
    case PointRule::greville_derivative:
      return greville_lines(knots, 1, closed);
    case PointRule::gauss_2x2:
      return gauss_lines(knots, 2);
    case PointRule::mid_span:
    case PointRule::half_span:
    case PointRule::gauss_1:
      return gauss_lines(knots, 1);
    case PointRule::knot_mesh:
    case PointRule::cell_average:
    case PointRule::springs_quad:
    case PointRule::springs_triangle:
      break;
  }
  return {};
}

constexpr NamedRule rules[] = {{"knot-mesh", PointRule::knot_mesh},
                               {"border", PointRule::border},
                               {"mid-span", PointRule::mid_span},
                               {"half-span", PointRule::half_span},
                               {"greville", PointRule::greville},
                               {"greville-derivative", PointRule::greville_derivative},
                               {"gauss-1", PointRule::gauss_1},
                               {"gauss-2x2", PointRule::gauss_2x2},
                               {"cell-average", PointRule::cell_average},
                               {"springs-quad", PointRule::springs_quad},
                               {"springs-triangle", PointRule::springs_triangle}};

}  // namespace

std::span<const NamedRule> point_rules() {
  return rules;
}

std::optional<PointRule> point_rule(std::string_view name) {
  const auto* found = std::ranges::find(rules, name, &NamedRule::name);
  return found == std::end(rules) ? std::nullopt : std::optional(found->rule);
}

std::vector<ConstraintPoint> apply_rule(PointRule rule, const TrimmedSurface& surface, const TrimTopology& topology,
                                        std::vector<ConstraintPoint>& listed, const Closure& closure) {
  const KnotMesh& mesh = topology.mesh;
  const bool knot_mesh = rule == PointRule::knot_mesh || rule == PointRule::border || rule == PointRule::mid_span ||
                         rule == PointRule::half_span;
  const bool knot_lines = rule == PointRule::border || rule == PointRule::half_span;
  const auto lines = [&](Direction d, const std::vector<double>& breaks) {
    std::vector<double> all = lines_of(rule, surface.surface.knots(d), closure.in(d));
    snap(all, breaks);
    if (knot_lines) all.insert(all.end(), breaks.begin(), breaks.end());
    std::ranges::sort(all);
    return all;
  };
  const std::vector<double> lines_u = lines(Direction::u, mesh.u), lines_v = lines(Direction::v, mesh.v);
  const auto among = [](const std::vector<double>& sorted, double u) { return std::ranges::binary_search(sorted, u); };
  const auto vertex = [&](double u, double v) { return among(mesh.u, u) && among(mesh.v, v); };
  const auto on_domain_border = [&](const ConstraintPoint& p) {
    return p.u == mesh.u.front() || p.u == mesh.u.back() || p.v == mesh.v.front() || p.v == mesh.v.back();
  };
  for (ConstraintPoint& point : listed) {
    const bool of_trim = point.kind != PointKind::vertex && !(vertex(point.u, point.v) && on_domain_border(point));
    const bool corner = point.kind == PointKind::corner;
    if ((knot_mesh && !corner) || (among(lines_u, point.u) && among(lines_v, point.v)) ||
        (of_trim && rule == PointRule::greville_derivative))
      continue;
    point.used = false;
    point.why = "rule";
  }
  std::vector<ConstraintPoint> points;
  for (const double v : lines_v)
    for (const double u : lines_u) {
      if (vertex(u, v) || !contains(surface, topology, {u, v})) continue;
      ConstraintPoint point;
      point.u = u;
      point.v = v;
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

void drop_extra_points(const NurbsSurface& surface, const SmoothSeams& seams, std::vector<ConstraintPoint>& extra) {
  for (const Direction d : {Direction::u, Direction::v}) {
    const auto across = [&](const ConstraintPoint& p) { return d == Direction::u ? p.u : p.v; };
    const auto along = [&](const ConstraintPoint& p) { return d == Direction::u ? p.v : p.u; };
    const std::vector<double> breaks = surface.knots(d).breaks();
    double last = breaks[breaks.size() - 2];
    for (const ConstraintPoint& p : extra)
      if (across(p) < breaks.back()) last = std::max(last, across(p));
    if (last == breaks[breaks.size() - 2]) continue;
    std::erase_if(extra, [&](const ConstraintPoint& p) { return across(p) == last && seams.at(surface, d, along(p)); });
  }
}

}  // namespace toile
