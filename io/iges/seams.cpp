// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/seams.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include "geometry/refine.h"
#include "io/iges/entity.h"

namespace toile::iges {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Whole periods that a loop runs through before it closes.
std::array<int, 2> windings(const FacePlane& plane, const TrimLoop& loop) {
  std::array<int, 2> out{};
  const Vector2d way = last(loop.curves.back()) - first(loop.curves.front());
  for (std::size_t k = 0; k < 2; ++k)
    if (plane.closed[k]) out[k] = static_cast<int>(std::lround(way[static_cast<Eigen::Index>(k)] / plane.period[k]));
  return out;
}

// The border of the domain in the other direction that is one point in space; which, where there are two, by what
// lies to the left of a loop that runs `forward`.
std::optional<double> pole(const FacePlane& plane, std::size_t k, bool forward) {
  const std::size_t other = 1 - k;
  std::array<bool, 2> collapsed{};
  for (std::size_t side = 0; side < 2; ++side) {
    const double line = side == 0 ? plane.domain[other].min : plane.domain[other].max;
    collapsed[side] = true;
    Vector3d before = Vector3d::Zero();
    for (int i = 0; i <= 4; ++i) {
      const double along = plane.domain[k].min + plane.domain[k].length() * i / 5;
      const Vector3d x = k == 0 ? plane.surface(along, line) : plane.surface(line, along);
      if (i > 0 && (x - before).norm() > 1e-6 * plane.size) collapsed[side] = false;
      before = x;
    }
  }
  // With u around, the left of a loop towards larger u is larger v; with v around it is smaller u.
  const bool want_max = (k == 0) == forward;
  if (collapsed[0] && collapsed[1]) return want_max ? plane.domain[other].max : plane.domain[other].min;
  if (collapsed[0]) return plane.domain[other].min;
  if (collapsed[1]) return plane.domain[other].max;
  return std::nullopt;
}

Interval range(const TrimLoop& loop, int axis) {
  Interval r{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const Vector2d& p : polygon(loop.curves)) {
    r.min = std::min(r.min, p[axis]);
    r.max = std::max(r.max, p[axis]);
  }
  return r;
}

double box_area(const TrimLoop& loop) {
  return range(loop, 0).length() * range(loop, 1).length();
}

void shift(PanelMark& mark, int axis, double by) {
  mark.at[axis] += by;
  if (!mark.curve) return;
  Curve2::Points points = mark.curve->points();
  points.row(axis).array() += by;
  mark.curve = Curve2(mark.curve->knots(), std::move(points), mark.curve->weights());
}

NurbsSurface unrolled_u(const NurbsSurface& closed, Interval window) {
  const NurbsSurface s = clamp(closed);
  const KnotVector& k = s.u();
  const int p = k.degree(), n = s.count_u();
  const double period = k.domain().length();
  std::vector<double> knots(k.knots().begin(), k.knots().end() - 1);
  for (int i = p + 1; i < n + p + 1; ++i) knots.push_back(i < n ? k[i] + period : k.domain().max + period);
  const int count = 2 * n - 1;
  Eigen::Matrix3Xd points(3, count * s.count_v());
  std::vector<double> weights;
  for (int j = 0; j < s.count_v(); ++j) {
    const double ratio = s.weight(s.index(n - 1, j)) / s.weight(s.index(0, j));
    for (int i = 0; i < count; ++i) {
      const int from = s.index(i < n ? i : i - n + 1, j);
      points.col(i + count * j) = s.points().col(from);
      if (s.rational()) weights.push_back(s.weight(from) * (i < n ? 1 : ratio));
    }
  }
  SplineSurface twice{NurbsSurface(KnotVector(p, std::move(knots)), s.v(), std::move(points), std::move(weights)),
                      window, s.v().domain()};
  return restricted(twice);
}

}  // namespace

NurbsSurface unrolled(const NurbsSurface& surface, Direction direction, Interval window) {
  return direction == Direction::u ? unrolled_u(surface, window) : transposed(unrolled_u(transposed(surface), window));
}

void join_across_seams(const FacePlane& plane, std::vector<BoundaryCurves>& boundaries, std::vector<TrimLoop>& loops) {
  for (std::size_t k = 0; k < 2; ++k) {
    std::vector<std::size_t> winding;
    for (std::size_t i = 0; i < loops.size(); ++i)
      if (windings(plane, loops[i])[k] != 0) winding.push_back(i);
    if (winding.empty()) continue;
    const auto axis = static_cast<Eigen::Index>(k);
    TrimLoop& a = loops[winding[0]];
    BoundaryCurves& place = boundaries[static_cast<std::size_t>(a.index)];
    const int turns = windings(plane, a)[k];
    const Vector2d from = first(a.curves.front()), to = last(a.curves.back());
    const int n = static_cast<int>(a.curves.size());
    if (winding.size() == 1 && std::abs(turns) == 1) {
      const std::optional<double> line = pole(plane, k, turns > 0);
      if (!line) plane.fail(place, "the loop runs around the closed surface and bounds nothing");
      Vector2d far = to, near = from;
      far[1 - axis] = near[1 - axis] = *line;
      a.curves.push_back(leg(to, far, n));
      a.curves.push_back(leg(far, near, n + 1));
      a.curves.push_back(leg(near, from, n + 2));
      plane.note(place, "seam", "the loop runs around the closed surface; it is joined with the pole");
    } else if (winding.size() == 2 && std::abs(turns) == 1) {
      TrimLoop& b = loops[winding[1]];
      if (windings(plane, b)[k] == turns) {
        std::reverse(b.curves.begin(), b.curves.end());
        for (TrimCurve& c : b.curves) c.reversed = !c.reversed;
      }
      const double period = plane.period[k];
      const double by = period * std::round((to[axis] - first(b.curves.front())[axis]) / period);
      for (TrimCurve& c : b.curves) shift(c, static_cast<int>(k), by);
      const Vector2d head = first(b.curves.front()), tail = last(b.curves.back());
      a.curves.push_back(leg(to, head, n));
      for (TrimCurve& c : b.curves) {
        c.index += n + 1;
        a.curves.push_back(c);
      }
      a.curves.push_back(leg(tail, from, static_cast<int>(a.curves.size())));
      plane.note(place, "seam", "two loops run around the closed surface; they are joined across its seam");
      loops.erase(loops.begin() + static_cast<std::ptrdiff_t>(winding[1]));
    } else {
      plane.fail(place, "loops run around the closed surface " + std::to_string(std::abs(turns)) + " times, " +
                            std::to_string(winding.size()) + " of them: what they bound is not clear");
    }
    place.converted = "loop joined across the seam of the closed surface";
  }
}

void gather(const FacePlane& plane, std::vector<TrimLoop>& loops) {
  for (std::size_t k = 0; k < 2; ++k) {
    if (!plane.closed[k]) continue;
    const int axis = static_cast<int>(k);
    const double period = plane.period[k], slack = 1e-9 * period;
    const auto largest = std::ranges::max_element(loops, {}, [](const TrimLoop& l) { return box_area(l); });
    const double begin = range(*largest, axis).min;
    std::vector<TrimLoop> again;
    for (TrimLoop& loop : loops) {
      const Interval r = range(loop, axis);
      const double by = -period * std::floor((r.min + slack - begin) / period);
      for (TrimCurve& c : loop.curves) shift(c, axis, by);
      if (&loop == &*largest || r.max + by - period <= begin + slack) continue;
      again.push_back(loop);
      for (TrimCurve& c : again.back().curves) shift(c, axis, -period);
    }
    std::ranges::move(again, std::back_inserter(loops));
  }
}

void fit_into_domain(const FacePlane& plane, std::vector<BoundaryCurves>& boundaries, TrimmedSurface& face) {
  for (std::size_t k = 0; k < 2; ++k) {
    if (!plane.closed[k]) continue;
    const double period = plane.period[k], slack = 1e-9 * period;
    TrimLoop& outer = face.loops[0];
    const BoundaryCurves& place = boundaries[static_cast<std::size_t>(outer.index)];
    Interval r = range(outer, static_cast<int>(k));
    const double by = -period * std::floor((r.min + slack - plane.domain[k].min) / period);
    if (by != 0) {
      for (TrimLoop& loop : face.loops)
        for (TrimCurve& c : loop.curves) shift(c, static_cast<int>(k), by);
      for (PanelMark& mark : face.marks) shift(mark, static_cast<int>(k), by);
      r.min += by, r.max += by;
      plane.note(place, "period",
                 "the loop lies beyond the closed surface's domain; it is moved by " + format_real(by));
    }
    if (r.length() > 2 * period - slack) plane.fail(place, "the loop runs around the closed surface more than twice");
    Interval window = plane.domain[k];
    if (r.max > plane.domain[k].max + slack) {
      window = {std::max(r.min, plane.domain[k].min), std::min(r.max, plane.domain[k].max + period)};
      // A window as wide as the domain keeps all of the surface.
      face.surface = unrolled(face.surface, k == 0 ? Direction::u : Direction::v, window);
      plane.note(place, "seam crossed",
                 "the loop crosses the seam of the closed surface; the surface is unrolled from " +
                     format_real(window.min) + " to " + format_real(window.max));
      boundaries[static_cast<std::size_t>(outer.index)].converted = "surface unrolled over its seam";
    }
  }
}

}  // namespace toile::iges
