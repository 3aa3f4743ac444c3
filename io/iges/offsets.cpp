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

FittedCurve to_curve(const OffsetCurve& offset, const Curve3& base, const Curve3* function, double tolerance) {
  if (offset.flag < 1 || offset.flag > 3 || (offset.flag == 3) != (function != nullptr))
    throw GeometryError("FLAG of the offset is " + std::to_string(offset.flag) + ", must be 1 to 3");
  if (function && (offset.coordinate < 1 || offset.coordinate > 3))
    throw GeometryError("NDIM of the offset is " + std::to_string(offset.coordinate) + ", must be 1 to 3");
  if (!(offset.normal.norm() > 0)) throw GeometryError("the offset's normal has no length");
  const Eigen::Vector3d z = offset.normal.normalized();
  const double d1 = offset.distances[0], t1 = offset.distances[1], d2 = offset.distances[2], t2 = offset.distances[3];
  const Interval domain = base.domain();
  const bool by_length = offset.kind == 1;
  if (offset.flag == 2 && !(t2 != t1)) throw GeometryError("the offset's two distances stand at one parameter");
  // Distance and its derivative at t.
  const auto argument = [&](double t) { return by_length ? arc_length(base, {domain.min, t}) : t; };
  const auto distance = [&](double t, double speed, int law_span) -> std::pair<double, double> {
    if (offset.flag == 1) return {d1, 0};
    const double at = argument(t);
    if (function) {
      const Interval known = function->domain();
      if (at < known.min - 1e-9 * known.length() || at > known.max + 1e-9 * known.length())
        throw GeometryError("the function of the offset ends before " + format_real(at));
      const CurveJet<3> f = evaluate_on_span(*function, law_span, std::clamp(at, known.min, known.max));
      return {f.x[offset.coordinate - 1], f.d1[offset.coordinate - 1] * (by_length ? speed : 1)};
    }
    const double slope = (d2 - d1) / (t2 - t1);
    return {d1 + (at - t1) * slope, by_length ? slope * speed : slope};
  };
  std::vector<SmoothPath<3>> path;
  Interval range = offset.range;
  if (!(domain.min <= range.min && range.min < range.max && range.max <= domain.max)) range = domain;
  const Curve3 part = range.min == domain.min && range.max == domain.max ? base : sub_curve(base, range);
  // Where the function may have a kink.
  constexpr std::size_t most_kinks = 100;
  std::vector<double> kinks;
  if (function) {
    const std::vector<double> breaks = function->knots().breaks();
    if (breaks.size() > most_kinks) throw GeometryError("the function of the offset has more than 100 knots");
    for (const double b : breaks) {
      Interval t = domain;
      for (int k = 0; by_length && k < 60; ++k) {
        const double middle = 0.5 * (t.min + t.max);
        (arc_length(base, {domain.min, middle}) < b ? t.min : t.max) = middle;
      }
      kinks.push_back(by_length ? t.max : b);
    }
  }
  for (const int span : part.knots().spans()) {
    std::vector<double> stops{part.knots()[span]};
    for (const double b : kinks)
      if (b > stops.front() && b < part.knots()[span + 1]) stops.push_back(b);
    stops.push_back(part.knots()[span + 1]);
    for (std::size_t k = 0; k + 1 < stops.size(); ++k) {
      const int law_span = function ? function->knots().find_span(argument(0.5 * (stops[k] + stops[k + 1]))) : 0;
      path.push_back(
          {{stops[k], stops[k + 1]}, [&, span, law_span](double t) {
             const CurveJet<3> c = evaluate_on_span(part, span, t);
             const double speed = c.d1.norm();
             if (!(speed > 0)) throw GeometryError("the curve that is offset has no direction somewhere");
             const Eigen::Vector3d along = c.d1 / speed;
             const Eigen::Vector3d turning = (c.d2 - along * along.dot(c.d2)) / speed;
             const auto [d, slope] = distance(t, speed, law_span);
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
