// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/dxf/curves.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/flat_panel.h"

namespace toile::dxf {

namespace {

using Eigen::Vector2d;

double turn(const Vector2d& before, const Vector2d& after) {
  return std::abs(std::atan2(before.x() * after.y() - before.y() * after.x(), before.dot(after))) * 180 /
         std::numbers::pi;
}

Curve3 lifted(const Curve2& flat, double height) {
  Eigen::Matrix3Xd points(3, flat.points().cols());
  points.topRows<2>() = flat.points();
  points.row(2).setConstant(height);
  return Curve3(flat.knots(), std::move(points), flat.weights());
}

// Points that repeat say nothing; an end on the start closes.
Polyline cleaned(const Polyline& line) {
  Polyline out;
  out.closed = line.closed;
  out.height = line.height;
  for (std::size_t k = 0; k < line.points.size(); ++k) {
    if (!out.points.empty() && out.points.back() == line.points[k]) {
      out.bulges.back() = line.bulges[k];
      continue;
    }
    out.points.push_back(line.points[k]);
    out.bulges.push_back(line.bulges[k]);
  }
  if (out.points.size() > 2 && out.points.front() == out.points.back()) {
    out.points.pop_back();
    out.bulges.pop_back();
    out.closed = true;
  }
  return out;
}

std::vector<Curve3> curves_of(const Polyline& drawn, const Corners& corners) {
  const Polyline line = cleaned(drawn);
  const std::size_t n = line.points.size();
  if (n < 2) return {};
  const std::size_t segments = line.closed ? n : n - 1;
  const auto point = [&](std::size_t k) { return line.points[k % n]; };
  const auto at_turn_point = [&](const Vector2d& p) {
    return std::ranges::any_of(corners.turn_points, [&](const Vector2d& t) { return (t - p).norm() <= corners.near; });
  };
  const bool turn_points = line.closed && std::ranges::any_of(line.points, at_turn_point);
  const auto corner = [&](std::size_t k) {
    if (turn_points) return at_turn_point(point(k));
    return turn(point(k) - point(k + n - 1), point(k + 1) - point(k)) >
           (line.closed ? corners.closed_angle : corners.open_angle);
  };
  std::size_t start = 0;
  if (line.closed)
    while (start < n && !corner(start)) ++start;
  if (start == n) start = 0;
  std::vector<Curve3> out;
  std::vector<Vector2d> run{point(start)};
  const auto flush = [&] {
    if (run.size() > 1) out.push_back(lifted(polyline_curve(run), line.height));
    run = {run.back()};
  };
  for (std::size_t k = start; k < start + segments; ++k) {
    const double bulge = line.bulges[k % n];
    if (bulge != 0 && std::abs(bulge) < largest_bulge) {
      flush();
      out.push_back(lifted(circular_arc_between(point(k), point(k + 1), 4 * std::atan(bulge)), line.height));
      run = {point(k + 1)};
      continue;
    }
    run.push_back(point(k + 1));
    if (k + 1 < start + segments && corner((k + 1) % n)) flush();
  }
  flush();
  return out;
}

}  // namespace

std::vector<Curve3> curves_of(const Item& item, const Corners& corners) {
  std::vector<Curve3> out;
  for (const Curve2& curve : item.curves) out.push_back(lifted(curve, 0));
  for (const Polyline& line : item.lines) {
    const std::vector<Curve3> pieces = curves_of(line, corners);
    out.insert(out.end(), pieces.begin(), pieces.end());
  }
  return out;
}

}  // namespace toile::dxf
