// SPDX-License-Identifier: GPL-3.0-or-later
// Entities 130 (offset curve) and 140 (offset surface). [IGES 5.3, 4.25, 4.30]
#include <algorithm>
#include <cmath>

#include "geometry/cubic_fit.h"
#include "geometry/error.h"
#include "geometry/refine.h"
#include "geometry/surface_fit.h"
#include "io/iges/surfaces.h"

namespace toile::iges {

OffsetSurface read_offset_surface(Parameters& in) {
  OffsetSurface offset;
  for (int axis = 0; axis < 3; ++axis) offset.indicator[axis] = in.real("coordinate of the offset indicator");
  offset.distance = in.real("D");
  offset.surface = in.pointer("DE");
  return offset;
}

void write(const OffsetSurface& offset, Record& out) {
  for (int axis = 0; axis < 3; ++axis) out.real(offset.indicator[axis]);
  out.real(offset.distance).integer(offset.surface);
}

namespace {

Eigen::Vector3d normal(const NurbsSurface& s, double u, double v) {
  const SurfaceJet jet = evaluate(s, u, v);
  const Eigen::Vector3d n = jet.u.cross(jet.v);
  if (!(n.norm() > 1e-12 * jet.u.norm() * jet.v.norm()))
    throw GeometryError("the surface that is offset has no normal at u = " + format_real(u) +
                        ", v = " + format_real(v));
  return n.normalized();
}

// The offset has one derivative less than its base.
std::vector<FitBreak> fit_breaks(const KnotVector& knots) {
  std::vector<FitBreak> out;
  for (const double b : knots.breaks()) out.push_back({b, knots.degree() - knots.multiplicity(b) - 1});
  return out;
}

}  // namespace

FileSurface to_surface(const OffsetSurface& offset, const FileSurface& base, double tolerance) {
  const NurbsSurface& s = base.surface;
  const Interval u = s.u().domain(), v = s.v().domain();
  double distance = offset.distance;
  const Eigen::Vector3d middle = normal(s, 0.5 * (u.min + u.max), 0.5 * (v.min + v.max));
  if (middle.dot(offset.indicator) < 0) distance = -distance;
  FileSurface out = base;
  out.plane.reset();
  const double size = (s.points().rowwise().maxCoeff() - s.points().rowwise().minCoeff()).norm();
  if (affine_patch(s, 1e-12 * size)) {
    out.surface = s.with_points(s.points().colwise() + distance * middle);
    out.how = "offset of a flat surface, moved";
    return out;
  }
  const SurfaceFit fit =
      fit_surface([&](double x, double y) -> Eigen::Vector3d { return s(x, y) + distance * normal(s, x, y); },
                  fit_breaks(s.u()), fit_breaks(s.v()), tolerance);
  out.surface = fit.surface;
  out.error = base.error + fit.error;
  out.how = "offset surface as bicubic B-spline";
  return out;
}

OffsetCurve read_offset_curve(Parameters& in) {
  OffsetCurve offset;
  offset.curve = in.pointer("DE1");
  offset.flag = in.integer("FLAG");
  offset.function = in.pointer("DE2");
  offset.coordinate = in.integer("NDIM");
  offset.kind = in.integer("PTYPE");
  for (double& d : offset.distances) d = in.real("distance of the offset");
  for (int axis = 0; axis < 3; ++axis) offset.normal[axis] = in.real("coordinate of the normal");
  offset.range.min = in.real("TT1");
  offset.range.max = in.real("TT2");
  return offset;
}

void write(const OffsetCurve& offset, Record& out) {
  out.integer(offset.curve)
      .integer(offset.flag)
      .integer(offset.function)
      .integer(offset.coordinate)
      .integer(offset.kind);
  for (const double d : offset.distances) out.real(d);
  for (int axis = 0; axis < 3; ++axis) out.real(offset.normal[axis]);
  out.real(offset.range.min).real(offset.range.max);
}

namespace {

// Distance of an offset curve from its base along it.
struct DistanceLaw {
  const OffsetCurve& offset;
  const Curve3& base;
  const Curve3* function;  // of FLAG 3, else null

  bool by_length() const { return offset.kind == 1; }
  double length_to(double t) const { return arc_length(base, {base.domain().min, t}); }
  // What the law depends on, at the base's parameter t.
  double argument(double t) const { return by_length() ? length_to(t) : t; }
  int span_at(double t) const { return function ? function->knots().find_span(argument(t)) : 0; }

  // Parameters of the base where the function may have a kink, ascending.
  std::vector<double> breaks() const {
    if (!function) return {};
    constexpr std::size_t most = 100;
    std::vector<double> out = function->knots().breaks();
    if (out.size() > most) throw GeometryError("the function of the offset has more than 100 knots");
    if (!by_length()) return out;
    for (double& at : out) {
      Interval t = base.domain();
      for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (t.min + t.max);
        (length_to(middle) < at ? t.min : t.max) = middle;
      }
      at = t.max;
    }
    return out;
  }

  // Distance and its derivative in t, where the base has this speed; `span` is the function's.
  std::pair<double, double> at(double t, double speed, int span) const {
    const auto [d1, t1, d2, t2] = offset.distances;
    if (offset.flag == 1) return {d1, 0};
    const double x = argument(t), dx = by_length() ? speed : 1;
    if (!function) {
      const double slope = (d2 - d1) / (t2 - t1);
      return {d1 + (x - t1) * slope, slope * dx};
    }
    const Interval known = function->domain();
    if (x < known.min - 1e-9 * known.length() || x > known.max + 1e-9 * known.length())
      throw GeometryError("the function of the offset ends before " + format_real(x));
    const CurveJet<3> f = evaluate_on_span(*function, span, std::clamp(x, known.min, known.max));
    return {f.x[offset.coordinate - 1], f.d1[offset.coordinate - 1] * dx};
  }
};

}  // namespace

FittedCurve to_curve(const OffsetCurve& offset, const Curve3& base, const Curve3* function, double tolerance) {
  if (offset.flag < 1 || offset.flag > 3 || (offset.flag == 3) != (function != nullptr))
    throw GeometryError("FLAG of the offset is " + std::to_string(offset.flag) + ", must be 1 to 3");
  if (function && (offset.coordinate < 1 || offset.coordinate > 3))
    throw GeometryError("NDIM of the offset is " + std::to_string(offset.coordinate) + ", must be 1 to 3");
  if (!(offset.normal.norm() > 0)) throw GeometryError("the offset's normal has no length");
  if (offset.flag == 2 && !(offset.distances[3] != offset.distances[1]))
    throw GeometryError("the offset's two distances stand at one parameter");
  const Eigen::Vector3d z = offset.normal.normalized();
  const DistanceLaw law{offset, base, function};
  const Interval domain = base.domain();
  std::vector<SmoothPath<3>> path;
  Interval range = offset.range;
  if (!(domain.min <= range.min && range.min < range.max && range.max <= domain.max)) range = domain;
  const Curve3 part = range.min == domain.min && range.max == domain.max ? base : sub_curve(base, range);
  const std::vector<double> breaks = law.breaks();
  const double one_place =
      1e-12 * range.length();  // lengths were solved for: a break at a knot may miss it by rounding
  for (const int span : part.knots().spans()) {
    std::vector<double> stops{part.knots()[span]};
    for (const double b : breaks)
      if (b > stops.back() + one_place && b < part.knots()[span + 1] - one_place) stops.push_back(b);
    stops.push_back(part.knots()[span + 1]);
    for (std::size_t k = 0; k + 1 < stops.size(); ++k) {
      const int law_span = law.span_at(0.5 * (stops[k] + stops[k + 1]));
      path.push_back(
          {{stops[k], stops[k + 1]}, [&, span, law_span](double t) {
             const CurveJet<3> c = evaluate_on_span(part, span, t);
             const double speed = c.d1.norm();
             if (!(speed > 0)) throw GeometryError("the curve that is offset has no direction somewhere");
             const Eigen::Vector3d along = c.d1 / speed;
             const Eigen::Vector3d turning = (c.d2 - along * along.dot(c.d2)) / speed;
             const auto [d, slope] = law.at(t, speed, law_span);
             return PathPoint<3>{c.x + d * z.cross(along), c.d1 + slope * z.cross(along) + d * z.cross(turning)};
           }});
    }
  }
  // At a kink the two sides part: no curve.
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double gap = (path[i].at(path[i].range.max).x - path[i + 1].at(path[i + 1].range.min).x).norm();
    if (gap > tolerance) throw GeometryError("the offset of a kink leaves a gap of " + format_real(gap));
  }
  CubicFitOptions<3> options;
  options.tolerance = tolerance;
  options.max_halvings = 12;
  CubicFit<3> fit = fit_cubic<3>(path, options);
  return {std::move(fit.curve), fit.error};
}

}  // namespace toile::iges
