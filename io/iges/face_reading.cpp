// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/face_reading.h"

#include <algorithm>

#include "geometry/error.h"
#include "io/iges/boundary_reading.h"
#include "io/iges/closed_chains.h"
#include "io/iges/curve_reading.h"
#include "io/iges/entity.h"
#include "io/iges/surface_reading.h"
#include "io/iges/surfaces.h"
#include "io/iges/topology.h"

namespace toile::iges {

namespace {

constexpr double usable_gap = 1e-3;  // of the surface's size

// What a face's record says, whatever its entity.
struct FaceRecord {
  int surface = 0;
  std::vector<int> loops;
  int loop_type = 0;       // what its boundaries must be
  bool has_outer = false;  // the first loop is said to be the outer one
  bool bounded_by_domain = false;
  std::string name;
};

FaceRecord record_of(Reading& reading, const Entry& e) {
  Parameters in(reading.file, e, &reading.notes);
  FaceRecord out;
  out.surface = e.sequence;  // a free surface is its own
  if (e.type == 144) {
    Face face = read_face(in);
    out.surface = face.surface;
    out.loops = std::move(face.holes);
    out.has_outer = face.outer != 0;
    out.bounded_by_domain = !out.has_outer;
    out.loop_type = 142;
    if (out.has_outer) out.loops.insert(out.loops.begin(), face.outer);
    if (face.outer_was_denied)
      reading.note(e, "N1", "N1 is 0 though an outer boundary is given; the boundary is taken");
    if (face.outer_is_missing)
      reading.note(e, "PTO", "N1 is 1 though no outer boundary is named; the border of the surface is taken");
  } else if (e.type == 143) {
    BoundedSurface face = read_bounded_surface(in);
    out.surface = face.surface;
    out.loops = std::move(face.boundaries);
    out.loop_type = 141;
  } else if (e.type == 510) {
    TopologicalFace face = read_topological_face(in);
    out.surface = face.surface;
    out.loops = std::move(face.loops);
    out.has_outer = face.outer_first;
    out.loop_type = 508;
  } else if (e.type == 108) {
    out.loops = {read_plane(in).boundary};
    out.has_outer = true;
  } else {
    return out;
  }
  out.name = reading.name_property(in);
  return out;
}

// Planes, cylinders and cones end where their boundary does.
bool has_no_end(const Entry& surface) {
  return surface.type == 108 || surface.type == 190 || surface.type == 192 || surface.type == 194;
}

// 141 and 142 stand for each other, with a warning.
const Entry& boundary_entry(Reading& reading, const Entry& e, const FaceRecord& face, int sequence, const char* role) {
  const Entry& found = reading.entry(sequence, e, role);
  if (face.loop_type == 0) return found;
  const int other = face.loop_type == 141 ? 142 : face.loop_type == 142 ? 141 : 0;
  if (other == 0 || found.type != other) return reading.entry(sequence, e, role, face.loop_type);
  reading.note(e, std::to_string(other) + " in " + std::to_string(e.type),
               "its boundary is an entity " + std::to_string(other) + ", must be " + std::to_string(face.loop_type) +
                   "; it is read as one");
  return found;
}

// The closed curve that bounds a plane 108 of form 1, in the plane's own space.
BoundaryCurves plane_boundary(Reading& reading, const Entry& plane, const Entry& curve) {
  BoundaryCurves out;
  out.place = reading.file.place(plane);
  const Eigen::Affine3d t = reading.transform(plane);
  for (const Curve3& c : curves_of(reading, curve.sequence, plane, "boundary")) out.model.push_back(transformed(t, c));
  return out;
}

// The curve that a plane 108 names as its border, or 0. In form -1 it bounds a hole.
int border_of_plane(Reading& reading, const Entry& surface) {
  if (surface.type != 108 || surface.form < 0) return 0;
  Parameters in(reading.file, surface, &reading.notes);
  return read_plane(in).boundary;
}

std::vector<std::array<Eigen::Vector3d, 2>> ends_of(const std::vector<Curve3>& curves) {
  std::vector<std::array<Eigen::Vector3d, 2>> out;
  for (const Curve3& c : curves) out.push_back({c.start(), c.end()});
  return out;
}

// In space, by the standard's reading of the parameters; the surface goes on beyond its domain.
std::vector<std::array<Eigen::Vector3d, 2>> ends_of(const std::vector<Curve3>& parameter_curves,
                                                    const FileSurface& surface) {
  std::vector<std::array<Eigen::Vector3d, 2>> out = ends_of(parameter_curves);
  for (std::array<Eigen::Vector3d, 2>& ends : out)
    for (Eigen::Vector3d& x : ends) {
      const Eigen::Vector2d uv = surface.maps[0](x.head<2>());
      x = surface.surface(uv.x(), uv.y());
    }
  return out;
}

// Boundaries with one closed chain each: a record may hold several.
std::vector<BoundaryCurves> part_chains(Reading& reading, const FileSurface& surface,
                                        std::vector<BoundaryCurves> boundaries) {
  const Eigen::Matrix3Xd& net = surface.surface.points();
  const double reach = usable_gap * (net.rowwise().maxCoeff() - net.rowwise().minCoeff()).norm();
  std::vector<BoundaryCurves> out;
  for (BoundaryCurves& b : boundaries) {
    const std::vector<std::size_t> model = closed_chains(ends_of(b.model), reach),
                                   parameter = closed_chains(ends_of(b.parameter, surface), reach);
    const std::size_t chains = b.model.empty() ? parameter.size() : model.size();
    if (chains == 1) {
      out.push_back(std::move(b));
      continue;
    }
    reading.notes.add("chains", b.place + "it holds " + std::to_string(chains) +
                                    " closed chains of curves; each counts as a boundary");
    const auto part = [&](const std::vector<Curve3>& curves, const std::vector<std::size_t>& begins, std::size_t k) {
      const auto at = [&](std::size_t i) {
        return curves.begin() + static_cast<std::ptrdiff_t>(i < begins.size() ? begins[i] : curves.size());
      };
      return std::vector<Curve3>(at(k), at(k + 1));
    };
    for (std::size_t k = 0; k < chains; ++k) {
      BoundaryCurves& one = out.emplace_back();
      one.place = b.place;
      one.parameter_preferred = b.parameter_preferred;
      one.record = b.record;
      one.model = b.model.empty() ? std::vector<Curve3>{} : part(b.model, model, k);
      // Parameter curves that don't part alike are left out: the model curves stand.
      if (parameter.size() == chains) one.parameter = part(b.parameter, parameter, k);
    }
  }
  return out;
}

}  // namespace

std::vector<TrimmedSurface> panels_of(Reading& reading, const Entry& e) {
  FaceRecord record = record_of(reading, e);
  std::vector<BoundaryCurves> boundaries;
  std::vector<const Entry*> entries;
  for (std::size_t i = 0; i < record.loops.size(); ++i) {
    const auto before = record.loops.begin() + static_cast<std::ptrdiff_t>(i);
    if (record.loops[i] == 0 || std::find(record.loops.begin(), before, record.loops[i]) != before) {
      reading.note(e, "idle boundary",
                   record.loops[i] == 0
                       ? "a pointer to a boundary is 0; it is passed over"
                       : "boundary " + std::to_string(record.loops[i]) + " is named twice; once counts");
      continue;
    }
    const char* role = i == 0 && record.has_outer ? "outer boundary" : "boundary";
    const Entry& from = boundary_entry(reading, e, record, record.loops[i], role);
    BoundaryCurves curves =
        e.type == 108 ? plane_boundary(reading, e, from) : boundary_of(reading, from, record.surface);
    // A loop that is one vertex bounds nothing: a whole sphere.
    if (curves.model.empty() && curves.parameter.empty()) continue;
    curves.record = entries.size();
    boundaries.push_back(std::move(curves));
    entries.push_back(&from);
  }
  const Entry& carrier = reading.entry(record.surface, e, "surface");
  // A plane may name the curve that bounds it: the border of the surface, where the face has none of its own.
  if (const int own = record.bounded_by_domain ? border_of_plane(reading, carrier) : 0; own != 0) {
    const Entry& from = reading.entry(own, carrier, "boundary");
    BoundaryCurves border = plane_boundary(reading, carrier, from);
    border.record = entries.size();
    boundaries.insert(boundaries.begin(), std::move(border));
    entries.push_back(&from);
    record.bounded_by_domain = false;
    record.has_outer = true;
  }
  if (record.bounded_by_domain && has_no_end(carrier))
    throw InputError(reading.file.place(e) + "it names no outer boundary, and its surface (entity " +
                     std::to_string(carrier.type) + ") has no border of its own");
  FaceOptions options;
  options.outer_known = record.has_outer || record.bounded_by_domain;
  options.resolution = reading.file.global.resolution;
  options.note = [&](const std::string& kind, const std::string& message) { reading.notes.add(kind, message); };
  std::string surface_name;
  FileSurface base = surface_of(reading, carrier, boundaries, surface_name);
  std::string name = std::move(record.name);
  if (name.empty()) name = surface_name;
  std::vector<TrimmedSurface> panels;
  if (boundaries.empty() || record.bounded_by_domain) {
    TrimmedSurface whole = untrimmed(base.surface);
    if (!boundaries.empty()) {
      // Every loop is a hole in the domain: as if its border were given.
      std::vector<BoundaryCurves> all(1);
      all[0].place = reading.file.place(e);
      for (const TrimCurve& c : whole.loops[0].curves) {
        Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 2);
        points.topRows<2>() = c.curve.points();
        all[0].parameter.emplace_back(c.curve.knots(), std::move(points));
      }
      all[0].record = entries.size();
      all.insert(all.end(), std::make_move_iterator(boundaries.begin()), std::make_move_iterator(boundaries.end()));
      boundaries = std::move(all);
      entries.push_back(&e);
    } else {
      panels.push_back(std::move(whole));
    }
  }
  if (panels.empty()) {
    try {
      boundaries = part_chains(reading, base, std::move(boundaries));
      panels = make_faces(base, boundaries, options);
    } catch (const GeometryError& error) {
      throw InputError(error.what());
    }
  }
  for (const BoundaryCurves& b : boundaries)
    reading.mark(*entries[b.record], b.converted.empty() ? Disposition::read : Disposition::converted, b.converted);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    panels[i].name = i == 0 || name.empty() ? name : name + " (" + std::to_string(i + 1) + ")";
    for (std::size_t k = 0; k < panels[i].loops.size(); ++k) panels[i].loops[k].index = static_cast<int>(k);
  }
  if (e.sequence != record.surface) reading.mark(e, Disposition::read);
  return panels;
}

}  // namespace toile::iges
