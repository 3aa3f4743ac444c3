// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/winding.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "geometry/finite.h"

namespace toile {
namespace {

// Crossings of the ray to the right of the point, just below v = point.v: 1 upwards, -1 downwards. Nothing where the
// point lies on the span.
std::optional<int> ray_crossings(const TrimSpan& span, const Eigen::Vector2d& point, PredicateCounts& counts) {
  const auto [v_min, v_max] = std::minmax_element(span.v.begin(), span.v.begin() + span.degree + 1);
  if (*v_max < point.y() || *v_min > point.y()) return 0;
  const auto [u_min, u_max] = std::minmax_element(span.u.begin(), span.u.begin() + span.degree + 1);
  if (*u_max < point.x()) return 0;
  if (span.first() == point || span.last() == point) return std::nullopt;
  const LineForm v(span, Axis::v, point.y()), u(span, Axis::u, point.x());
  if (v.zero()) {
    // Along the ray: never crosses the line just below, but may hold the point.
    if (u.zero() || !roots(u, counts).empty()) return std::nullopt;
    return 0;
  }
  // Sides of the line just below: on v = point.v counts as above.
  const bool starts_above = v.coefficient_sign(0) >= 0, ends_above = v.coefficient_sign(v.degree()) >= 0;
  if (*u_min > point.x()) return static_cast<int>(ends_above) - static_cast<int>(starts_above);
  int total = 0;
  int side = v.sign_after_start();
  if (starts_above && side < 0 && u.coefficient_sign(0) > 0) --total;
  for (LineRoot& root : roots(v, counts)) {
    const int right = sign_at_root(u, v, root, counts);
    if (right == 0) return std::nullopt;
    if (!root.crosses) continue;
    if (right > 0) total += side < 0 ? 1 : -1;
    side = -side;
  }
  if (side < 0 && ends_above && u.coefficient_sign(u.degree()) > 0) ++total;
  return total;
}

}  // namespace

std::optional<int> winding_number(std::span<const TrimSpan> spans, const Eigen::Vector2d& point,
                                  PredicateCounts& counts) {
  require_finite(point, "the point asked about");
  int total = 0;
  for (const TrimSpan& span : spans) {
    const std::optional<int> n = ray_crossings(span, point, counts);
    if (!n) return std::nullopt;
    total += *n;
  }
  return total;
}

std::optional<int> winding_number(const std::vector<TrimLoop>& loops, const TrimSpans& spans, int loop,
                                  const Eigen::Vector2d& point, PredicateCounts& counts) {
  const std::vector<TrimCurve>& curves = loops[static_cast<std::size_t>(loop)].curves;
  int total = 0;
  for (std::size_t c = 0; c < curves.size(); ++c) {
    const auto n = winding_number(spans.of(loop, static_cast<int>(c)), point, counts);
    if (!n) return std::nullopt;
    total += curves[c].reversed ? -*n : *n;
  }
  return total;
}

int winding_around(const std::vector<TrimLoop>& loops, const TrimSpans& spans, int loop, int of,
                   PredicateCounts& counts) {
  const auto box = [&](int l) {
    Eigen::AlignedBox2d b;
    for (const TrimCurve& c : loops[static_cast<std::size_t>(l)].curves)
      for (const auto& p : c.curve.points().colwise()) b.extend(p);
    return b;
  };
  if (!box(loop).intersects(box(of))) return 0;
  for (const TrimSpan& span : spans.of(loop))
    if (const auto n = winding_number(loops, spans, of, span.first(), counts)) return *n;
  // Rounding moves a place by 8 eps of its coordinates at most.
  for (const TrimSpan& span : spans.of(loop)) {
    for (const double s : {0.5, 0.25, 0.75}) {
      const Eigen::Vector2d x = span.at(s), d = 8 * std::numeric_limits<double>::epsilon() * x.cwiseAbs();
      const auto near = [&](double u, double v) {
        return winding_number(loops, spans, of, x + Eigen::Vector2d(u * d.x(), v * d.y()), counts);
      };
      const auto n = near(1, 1);
      if (n && n == near(-1, -1) && n == near(1, -1) && n == near(-1, 1)) return *n;
    }
  }
  return 0;
}

}  // namespace toile
