// SPDX-License-Identifier: GPL-3.0-or-later
// Entities 108 (plane), 190 (plane surface), 192 (cylinder), 194 (cone), 196 (sphere), 198 (torus).
// [IGES 5.3, 4.12, 4.49 to 4.53]
#include <cmath>
#include <numbers>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "io/iges/surfaces.h"

namespace toile::iges {

Plane read_plane(Parameters& in) {
  Plane plane;
  for (double& c : plane.coefficients) c = in.real("coefficient of the plane");
  plane.boundary = in.pointer("PTR");
  for (int axis = 0; axis < 3; ++axis) plane.place[axis] = in.real("coordinate of the display symbol");
  plane.size = in.real("SIZE");
  return plane;
}

void write(const Plane& plane, Record& out) {
  for (const double c : plane.coefficients) out.real(c);
  out.integer(plane.boundary);
  for (int axis = 0; axis < 3; ++axis) out.real(plane.place[axis]);
  out.real(plane.size);
}

Analytic read_analytic(Parameters& in) {
  Analytic s;
  s.type = in.entry().type;
  s.location = in.pointer("DELOC");
  if (s.type == 196) {
    s.radius = in.real("RADIUS");
    s.axis = in.pointer("DEAXIS");
  } else {
    s.axis = in.pointer("DEAXIS");
    if (s.type != 190) s.radius = in.real("RADIUS");
    if (s.type == 194) s.second = in.real("SANGLE");
    if (s.type == 198) s.second = in.real("MINRAD");
  }
  // Form 0 has no reference direction; a sphere of form 0 has no axis either, and its record ends.
  if (in.entry().form == 1) {
    s.reference = in.pointer("DEREFD");
  } else if (s.type == 196) {
    s.axis = 0;
  }
  if (s.type != 190 && !(s.radius >= 0 && (s.radius > 0 || s.type == 194)))
    in.fail("the radius is " + format_real(s.radius) + ", must be positive");
  if (s.type == 194 && !(s.second > 0 && s.second < 90))
    in.fail("the cone's half angle is " + format_real(s.second) + " degrees, must lie between 0 and 90");
  if (s.type == 198 && !(s.second > 0 && s.second < s.radius))
    in.fail("the torus has radii " + format_real(s.radius) + " and " + format_real(s.second) +
            ", the second must be positive and the smaller");
  return s;
}

void write(const Analytic& s, Record& out) {
  out.integer(s.location);
  if (s.type == 196) {
    out.real(s.radius);
    if (s.axis != 0) out.integer(s.axis);
  } else {
    out.integer(s.axis);
    if (s.type != 190) out.real(s.radius);
    if (s.type == 194 || s.type == 198) out.real(s.second);
  }
  if (s.reference != 0) out.integer(s.reference);
}

Frame frame(const Eigen::Vector3d& origin, const Eigen::Vector3d& axis,
            const std::optional<Eigen::Vector3d>& reference) {
  if (!(axis.norm() > 0)) throw GeometryError("the surface's axis has no length");
  Frame f;
  f.origin = origin;
  f.z = axis.normalized();
  // Without a reference any will do; world x or y keep plain numbers plain.
  const Eigen::Vector3d wanted =
      reference ? *reference : (std::abs(f.z.x()) < 0.9 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY());
  const Eigen::Vector3d x = wanted - f.z * f.z.dot(wanted);
  if (!(x.norm() > 1e-12 * wanted.norm())) throw GeometryError("the surface's reference direction runs along its axis");
  f.x = x.normalized();
  f.y = f.z.cross(f.x);
  return f;
}

Frame frame(const Plane& plane) {
  const Eigen::Vector3d normal(plane.coefficients[0], plane.coefficients[1], plane.coefficients[2]);
  if (!(normal.norm() > 0)) throw GeometryError("the plane has no normal");
  return frame(normal * (plane.coefficients[3] / normal.squaredNorm()), normal, std::nullopt);
}

FileSurface plane_patch(const Frame& f, const Eigen::AlignedBox2d& reach) {
  const Eigen::Vector2d a = reach.min(), b = reach.max();
  if (reach.isEmpty() || !(b - a).allFinite() || !((b - a).minCoeff() > 0))
    throw GeometryError("what bounds the plane encloses nothing");
  const auto at = [&](double x, double y) -> Eigen::Vector3d { return f.origin + x * f.x + y * f.y; };
  Eigen::Matrix3Xd points(3, 4);
  points << at(a.x(), a.y()), at(b.x(), a.y()), at(a.x(), b.y()), at(b.x(), b.y());
  FileSurface out;
  out.surface = NurbsSurface(KnotVector(1, {a.x(), a.x(), b.x(), b.x()}), KnotVector(1, {a.y(), a.y(), b.y(), b.y()}),
                             std::move(points));
  out.how = "plane as B-spline surface";
  out.plane = f;
  return out;
}

FileSurface to_surface(const Analytic& s, const Frame& f, Interval height) {
  constexpr double pi = std::numbers::pi, degree = pi / 180;
  Curve3 profile;  // in the plane of x and z, at angle 0
  FileSurface out;
  std::vector<Turn> profile_turns;
  double slant = 1;
  switch (s.type) {
    case 192:
    case 194: {
      const double slope = s.type == 194 ? std::tan(s.second * degree) : 0;
      if (s.type == 194) {
        slant = std::cos(s.second * degree);
        height.min = std::max(height.min, -s.radius / slope);
      }
      if (!(height.length() > 0)) throw GeometryError("what bounds the surface has no height along its axis");
      const auto at = [&](double z) -> Eigen::Vector3d {
        const double r = z == -s.radius / slope ? 0 : s.radius + z * slope;
        return f.origin + r * f.x + z * f.z;
      };
      profile = with_domain(line_segment<3>(at(height.min), at(height.max)), height);
      out.how = s.type == 192 ? "cylinder" : "cone";
      break;
    }
    case 196:
    case 198: {
      const bool sphere = s.type == 196;
      const Interval angle = sphere ? Interval{-pi / 2, pi / 2} : Interval{0, 2 * pi};
      const double r = sphere ? s.radius : s.second;
      const Curve2 arc = with_domain(circular_arc({sphere ? 0 : s.radius, 0}, r, angle.min, angle.max), angle);
      Eigen::Matrix2Xd flat = arc.points();
      if (sphere) flat(0, 0) = flat(0, flat.cols() - 1) = 0;  // the poles lie on the axis
      Eigen::Matrix3Xd points = (f.x * flat.row(0) + f.z * flat.row(1)).colwise() + f.origin;
      profile = Curve3(arc.knots(), std::move(points), arc.weights());
      profile_turns = {{angle, sphere ? 2 : 4, angle.length()}};
      out.how = sphere ? "sphere" : "torus";
      break;
    }
    default:
      throw GeometryError("entity " + std::to_string(s.type) + " is no surface of revolution");
  }
  out.how += " as rational B-spline surface";
  out.surface = transposed(revolved(profile, f.origin, f.z, {0, 2 * pi}));
  // The standard counts degrees, and a cone's second parameter along its axis; exporters use radians and the slant too.
  out.maps.clear();
  out.degrees_or_radians = true;
  const AxisMap turn{1, 0, {{{0, 2 * pi}, 4, 2 * pi}}}, along{1, 0, profile_turns};
  for (const double cosine : slant == 1 ? std::vector<double>{1} : std::vector<double>{1, slant})
    for (const double unit : {degree, 1.0}) {
      ParameterMap map{turn, along};
      map.u.scale = unit;
      map.v.scale = profile_turns.empty() ? cosine : unit;
      out.maps.push_back(map);
    }
  return out;
}

}  // namespace toile::iges
