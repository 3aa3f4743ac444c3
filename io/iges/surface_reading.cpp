// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/surface_reading.h"

#include "geometry/error.h"
#include "io/iges/curve_reading.h"
#include "io/iges/entity.h"
#include "io/iges/surfaces.h"

namespace toile::iges {

namespace {

FileSurface surface_at(Reading& reading, const Entry& e, const std::vector<BoundaryCurves>& boundaries,
                       std::string& name, int depth);

Frame analytic_frame(Reading& reading, const Entry& e, const Analytic& s) {
  const auto direction = [&](int sequence, const char* role) {
    const Entry& d = reading.entry(sequence, e, role, 123);
    Parameters in(reading.file, d, &reading.notes);
    const Eigen::Vector3d x = read_direction(in);
    reading.mark(d, Disposition::read);
    return Eigen::Vector3d(reading.transform(d).linear() * x);
  };
  const Entry& location = reading.entry(s.location, e, "location", 116);
  Parameters in(reading.file, location, &reading.notes);
  const Eigen::Vector3d origin = reading.transform(location) * read_point(in).x;
  reading.mark(location, Disposition::read);
  const Eigen::Vector3d axis = s.axis != 0 ? direction(s.axis, "axis") : Eigen::Vector3d::UnitZ();
  std::optional<Eigen::Vector3d> reference;
  if (s.reference != 0) reference = direction(s.reference, "reference direction");
  return frame(origin, axis, reference);
}

// Boundary curves seen from the surface's own definition space.
std::vector<BoundaryCurves> seen_from(const Eigen::Affine3d& t, const std::vector<BoundaryCurves>& boundaries) {
  const Eigen::Affine3d back = t.inverse();
  std::vector<BoundaryCurves> out = boundaries;
  for (BoundaryCurves& b : out)
    for (Curve3& c : b.model) c = transformed(back, c);
  return out;
}

// The surface before its own matrix `t`, and the boundaries alike; but planes are placed at once, so that their corners
// and their boundaries' parameters are the same numbers.
FileSurface own_surface(Reading& reading, const Entry& e, const Eigen::Affine3d& t,
                        const std::vector<BoundaryCurves>& boundaries, std::string& name, int depth) {
  if (depth > max_depth) throw InputError(reading.file.place(e) + "its surfaces form a cycle");
  const bool trimmed = !boundaries.empty();
  reading.spend(e);
  Parameters in(reading.file, e, &reading.notes);
  // Tolerance of what has to be fitted: the size is that of the net which the fit starts from.
  const auto tolerance = [&](const Eigen::Matrix3Xd& points) {
    return reading.fit_tolerance((points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm());
  };
  // What bounds a surface without ends: model curves, else parameter curves, in its frame.
  const auto extent = [&](const Frame& f) {
    Eigen::AlignedBox3d box = reach(f, boundaries);
    if (!box.isEmpty()) return box;
    for (const BoundaryCurves& b : boundaries)
      for (const Curve3& c : b.parameter)
        for (const auto& p : c.points().colwise())
          box.extend(e.type == 108 || e.type == 190 ? Eigen::Vector3d(p.x(), p.y(), 0) : Eigen::Vector3d(0, 0, p.y()));
    return box;
  };
  switch (e.type) {
    case 108: {
      const Frame f = frame(read_plane(in)).placed(t);
      name = reading.name_property(in);
      const Eigen::AlignedBox3d box = extent(f);
      if (box.isEmpty()) in.fail("a plane without a boundary has no end");
      return plane_patch(f, {box.min().head<2>(), box.max().head<2>()});
    }
    case 190:
    case 192:
    case 194:
    case 196:
    case 198: {
      const Analytic s = read_analytic(in);
      name = reading.name_property(in);
      Frame f = analytic_frame(reading, e, s);
      if (e.type == 190) f = f.placed(t);
      const Eigen::AlignedBox3d box = extent(f);
      if (e.type < 196 && box.isEmpty()) in.fail("a surface without a boundary has no end");
      if (e.type == 190) return plane_patch(f, {box.min().head<2>(), box.max().head<2>()});
      return to_surface(s, f, box.isEmpty() ? Interval{} : Interval{box.min().z(), box.max().z()});
    }
    case 114: {
      const PowerSurface s = read_power_surface(in);
      name = reading.name_property(in);
      FileSurface out;
      JoinedSurface joined = to_surface(s, in.resolution());
      out.surface = std::move(joined.surface);
      out.how = "parametric spline surface as B-spline surface";
      if (joined.gap > 1e-12 * out.surface.points().cwiseAbs().maxCoeff())
        out.how += ", gaps of up to " + format_real(joined.gap) + " between its patches closed";
      const Interval u = out.surface.u().domain(), v = out.surface.v().domain();
      out.maps = readings({{}, u, {{0, u.length()}, {0, 1}}}, {{}, v, {{0, v.length()}, {0, 1}}});
      return out;
    }
    case 118: {
      const Ruled ruled = read_ruled(in);
      name = reading.name_property(in);
      NaturalCurve a = natural_curve_of(reading, reading.entry(ruled.first, e, "first curve")),
                   b = natural_curve_of(reading, reading.entry(ruled.second, e, "second curve"));
      Eigen::Matrix3Xd both(3, a.curve.points().cols() + b.curve.points().cols());
      both << a.curve.points(), b.curve.points();
      return to_surface(ruled, std::move(a), std::move(b), e.form == 0, tolerance(both));
    }
    case 120: {
      const Revolution revolution = read_revolution(in);
      name = reading.name_property(in);
      const Curve3 axis = natural_curve_of(reading, reading.entry(revolution.axis, e, "axis")).curve;
      return to_surface(revolution, axis,
                        natural_curve_of(reading, reading.entry(revolution.generatrix, e, "generatrix")));
    }
    case 122: {
      const Tabulated tabulated = read_tabulated(in);
      name = reading.name_property(in);
      return to_surface(tabulated, natural_curve_of(reading, reading.entry(tabulated.directrix, e, "directrix")));
    }
    case 140: {
      const OffsetSurface offset = read_offset_surface(in);
      name = reading.name_property(in);
      std::string base_name;
      // A boundary lies about as far along the base as along the offset.
      const FileSurface base =
          surface_at(reading, reading.entry(offset.surface, e, "surface to offset"), boundaries, base_name, depth + 1);
      return to_surface(offset, base, tolerance(base.surface.points()));
    }
    case 128:
      break;
    default:
      throw InputError(reading.file.place(e) +
                       "as a face's surface it is not read, must be 108, 114, 118, 120, 122, 128, 140, 190, 192, "
                       "194, 196 or 198");
  }
  // U0 to V1 say where an untrimmed surface ends. Where a loop bounds it the loop decides, and the surface keeps its
  // own knots and net: several exporters put the loop's bounding box there.
  const SplineSurface spline = read_spline_surface(in);
  name = reading.name_property(in);
  FileSurface out;
  out.surface = spline.surface;
  if (!spline.covers_domain() && trimmed) {
    reading.note(e, "partial", "U0 to V1 name a part of the knots' domain; the face is trimmed, so the domain stays");
  } else if (!spline.covers_domain()) {
    reading.note(e, "restricted", "U0 to V1 name a part of the knots' domain; the surface is restricted to it");
    out.surface = restricted(spline);
    out.how = "restricted to U0, U1, V0, V1";
  }
  return out;
}

FileSurface surface_at(Reading& reading, const Entry& e, const std::vector<BoundaryCurves>& boundaries,
                       std::string& name, int depth) {
  const Eigen::Affine3d t = reading.transform(e);
  const bool as_they_are = e.type == 108 || e.type == 128 || e.type == 190 || is_identity(t);
  FileSurface out;
  try {
    out = own_surface(reading, e, t, as_they_are ? boundaries : seen_from(t, boundaries), name, depth);
  } catch (const GeometryError& error) {
    throw InputError(reading.file.place(e) + error.what());
  }
  if (!is_identity(t) && !out.plane) out.surface = out.surface.with_points(t * out.surface.points());
  std::string how = out.how;
  if (out.error > 0) how += ", off by " + format_real(out.error);
  if (out.error > 0) reading.note(e, "fitted surface", how);
  const Disposition disposition = how.empty() ? Disposition::read : Disposition::converted;
  reading.mark(e, disposition, std::move(how));
  return out;
}

}  // namespace

FileSurface surface_of(Reading& reading, const Entry& e, const std::vector<BoundaryCurves>& boundaries,
                       std::string& name) {
  return surface_at(reading, e, boundaries, name, 0);
}

}  // namespace toile::iges
