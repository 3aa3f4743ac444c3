// SPDX-License-Identifier: GPL-3.0-or-later
// Entities 100 (circular arc), 106 (copious data), 110 (line), 102 (composite curve). [IGES 5.3, 4.3 to 4.7, 4.13]
#include <cmath>
#include <numbers>

#include "geometry/error.h"
#include "io/iges/entity.h"

namespace toile::iges {

Arc read_arc(Parameters& in) {
  Arc arc;
  arc.height = in.real("ZT");
  for (Eigen::Vector2d* point : {&arc.centre, &arc.start, &arc.end})
    for (int axis = 0; axis < 2; ++axis) (*point)[axis] = in.real("coordinate of the arc");
  const double radius = (arc.start - arc.centre).norm(), other = (arc.end - arc.centre).norm();
  if (!(radius > 0)) in.fail("the arc's radius is 0, must be positive");
  // Files with few digits: the ends count, and the start's radius.
  if (std::abs(radius - other) > 1e-2 * radius)
    in.fail("the arc starts at radius " + format_real(radius) + " and ends at radius " + format_real(other) +
            ", must be the same within a hundredth");
  if (std::abs(radius - other) > 1e-3 * radius)
    in.note("arc", "the arc starts at radius " + format_real(radius) + " and ends at radius " + format_real(other));
  return arc;
}

void write(const Arc& arc, Record& out) {
  out.real(arc.height);
  for (const Eigen::Vector2d& point : {arc.centre, arc.start, arc.end}) out.real(point.x()).real(point.y());
}

Interval arc_angles(const Arc& arc) {
  const Eigen::Vector2d a = arc.start - arc.centre, b = arc.end - arc.centre;
  Interval angles{std::atan2(a.y(), a.x()), std::atan2(b.y(), b.x())};
  if (angles.min < 0) {
    angles.min += 2 * std::numbers::pi;
    angles.max += 2 * std::numbers::pi;
  }
  if (arc.start == arc.end) {
    angles.max = angles.min + 2 * std::numbers::pi;
  } else if (angles.max <= angles.min) {
    angles.max += 2 * std::numbers::pi;
  } else if (angles.length() > 2 * std::numbers::pi) {
    angles.max -= 2 * std::numbers::pi;
  }
  return angles;
}

Curve3 to_curve(const Arc& arc) {
  const Interval angles = arc_angles(arc);
  const Curve2 flat = circular_arc(arc.centre, (arc.start - arc.centre).norm(), angles.min, angles.max);
  Eigen::Matrix3Xd points(3, flat.points().cols());
  points.topRows<2>() = flat.points();
  // The ends are the file's own numbers.
  points.col(0).head<2>() = arc.start;
  points.col(points.cols() - 1).head<2>() = arc.end;
  points.row(2).setConstant(arc.height);
  return Curve3(flat.knots(), std::move(points), flat.weights());
}

Segment read_segment(Parameters& in) {
  Segment segment;
  for (Eigen::Vector3d* point : {&segment.start, &segment.end})
    for (int axis = 0; axis < 3; ++axis) (*point)[axis] = in.real("coordinate of the line");
  return segment;
}

void write(const Segment& segment, Record& out) {
  for (const Eigen::Vector3d& point : {segment.start, segment.end})
    for (int axis = 0; axis < 3; ++axis) out.real(point[axis]);
}

CopiousData read_copious(Parameters& in) {
  CopiousData data;
  data.kind = in.integer("IP");
  const int n = in.integer("N");
  if (data.kind < 1 || data.kind > 3) in.fail("IP is " + std::to_string(data.kind) + ", must be 1, 2 or 3");
  if (n < 1) in.fail("N is " + std::to_string(n) + ", must be positive");
  const long long width = data.kind == 1 ? 2 : data.kind == 2 ? 3 : 6;
  in.expect(width * n + (data.kind == 1 ? 1 : 0), std::to_string(n) + " points");
  if (data.kind == 1) data.height = in.real("ZT");
  for (long long i = 0; i < width * n; ++i)
    data.numbers.push_back(in.real("coordinate of point", static_cast<int>(i / width)));
  return data;
}

void write(const CopiousData& data, Record& out) {
  const std::size_t width = data.kind == 1 ? 2 : data.kind == 2 ? 3 : 6;
  out.integer(data.kind).integer(static_cast<long long>(data.numbers.size() / width));
  if (data.kind == 1) out.real(data.height);
  for (double number : data.numbers) out.real(number);
}

Curve3 to_curve(const CopiousData& data, bool closed) {
  const std::size_t width = data.kind == 1 ? 2 : data.kind == 2 ? 3 : 6;
  std::vector<Eigen::Vector3d> places;
  for (std::size_t at = 0; at + width <= data.numbers.size(); at += width) {
    const Eigen::Vector3d x(data.numbers[at], data.numbers[at + 1],
                            data.kind == 1 ? data.height : data.numbers[at + 2]);
    if (places.empty() || x != places.back()) places.push_back(x);
  }
  if (closed && !places.empty() && places.back() != places.front()) places.push_back(places.front());
  const auto n = static_cast<int>(places.size());
  if (n < 2) throw GeometryError("a polyline needs two points, there is one");
  Eigen::Matrix3Xd points(3, n);
  std::vector<double> knots{0};
  for (int i = 0; i < n; ++i) {
    points.col(i) = places[static_cast<std::size_t>(i)];
    knots.push_back(i);
  }
  knots.push_back(n - 1);
  return Curve3(KnotVector(1, std::move(knots)), std::move(points));
}

std::vector<int> read_composite(Parameters& in) {
  const int n = in.integer("N");
  if (n < 1) in.fail("N is " + std::to_string(n) + ", must be positive");
  in.expect(n, std::to_string(n) + " curves");
  std::vector<int> curves;
  for (int i = 0; i < n; ++i) curves.push_back(in.pointer("pointer to a curve"));
  return curves;
}

void write_composite(const std::vector<int>& curves, Record& out) {
  out.integer(static_cast<long long>(curves.size()));
  for (int curve : curves) out.integer(curve);
}

}  // namespace toile::iges
