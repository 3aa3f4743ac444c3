// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/boundary_reading.h"

#include <algorithm>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "io/iges/curve_reading.h"
#include "io/iges/entity.h"
#include "io/iges/topology.h"

namespace toile::iges {

namespace {

void compare_surfaces(Reading& reading, const Entry& e, int own, int surface) {
  if (own != 0 && own != surface)
    reading.note(e, "boundary surface",
                 "it names surface " + std::to_string(own) + ", its face names " + std::to_string(surface) +
                     "; the face's is taken");
}

// The curves of one edge, in the boundary's direction.
void append_model(std::vector<Curve3> edge, bool forward, const Eigen::Affine3d& t, std::vector<Curve3>& out) {
  if (!forward) {
    std::reverse(edge.begin(), edge.end());
    for (Curve3& c : edge) c = reversed(c);
  }
  for (const Curve3& c : edge) out.push_back(transformed(t, c));
}

BoundaryCurves curve_on_surface(Reading& reading, const Entry& e, int surface) {
  reading.spend(e);
  Parameters in(reading.file, e, &reading.notes);
  const Boundary boundary = read_boundary(in);
  compare_surfaces(reading, e, boundary.surface, surface);
  if (boundary.parameter_curve == 0 && boundary.model_curve == 0)
    in.fail("it has neither a parameter curve nor a model curve");
  BoundaryCurves out;
  out.place = reading.file.place(e);
  out.parameter_preferred = boundary.preference == 1;
  std::string lost;
  if (boundary.model_curve != 0) {
    try {
      out.model = curves_of(reading, boundary.model_curve, e, "model curve");
      const Eigen::Affine3d t = reading.transform(e);
      for (Curve3& c : out.model) c = transformed(t, c);
    } catch (const InputError& error) {
      if (boundary.parameter_curve == 0 || boundary.parameter_curve == boundary.model_curve) throw;
      lost = std::string(error.what()) + "; the model curve of the boundary is ignored";
      out.model.clear();
    }
  }
  // A parameter curve that is the model curve itself (planes of some exporters) is none.
  if (boundary.parameter_curve != 0 && boundary.parameter_curve != boundary.model_curve) {
    try {
      out.parameter = curves_of(reading, boundary.parameter_curve, e, "parameter curve");
    } catch (const InputError& error) {
      if (out.model.empty()) throw;
      reading.notes.add("bad parameter curve",
                        std::string(error.what()) + "; the parameter curve of the boundary is ignored");
      out.parameter.clear();
    }
  }
  if (!lost.empty()) reading.notes.add("bad model curve", lost);
  if (out.model.empty() && out.parameter.empty()) in.fail("its curves are points only");
  return out;
}

BoundaryCurves boundary_list(Reading& reading, const Entry& e, int surface) {
  reading.spend(e);
  Parameters in(reading.file, e, &reading.notes);
  const BoundaryList boundary = read_boundary_list(in);
  compare_surfaces(reading, e, boundary.surface, surface);
  BoundaryCurves out;
  out.place = reading.file.place(e);
  out.parameter_preferred = boundary.preference == 2;
  const Eigen::Affine3d t = reading.transform(e);
  bool every_edge = true;
  for (const BoundaryUse& use : boundary.curves) {
    if (use.model != 0) append_model(curves_of(reading, use.model, e, "model curve"), use.sense != 2, t, out.model);
    every_edge = every_edge && !use.parameter_curves.empty();
    for (const int sequence : use.parameter_curves) {
      if (sequence == use.model) {
        every_edge = false;
        continue;
      }
      for (Curve3& c : curves_of(reading, sequence, e, "parameter curve")) out.parameter.push_back(std::move(c));
    }
  }
  if (!every_edge) out.parameter.clear();
  if (out.model.empty() && out.parameter.empty()) in.fail("it has neither parameter curves nor model curves");
  reading.mark(e, Disposition::read);
  return out;
}

BoundaryCurves edge_loop(Reading& reading, const Entry& e) {
  reading.spend(e);
  Parameters in(reading.file, e, &reading.notes);
  const EdgeLoop loop = read_edge_loop(in);
  BoundaryCurves out;
  out.place = reading.file.place(e);
  const Eigen::Affine3d t = reading.transform(e);
  bool every_edge = true;
  for (const EdgeUse& use : loop.edges) {
    for (const EdgeUse::ParameterCurve& curve : use.curves)
      for (Curve3& c : curves_of(reading, curve.curve, e, "parameter curve")) out.parameter.push_back(std::move(c));
    // A vertex is a collapsed edge: it has a parameter curve or none, never a model curve.
    if (use.vertex) continue;
    every_edge = every_edge && !use.curves.empty();
    const Entry& list = reading.entry(use.list, e, "edge list", 504);
    const std::vector<Edge>& edges = reading.edges_of(list).edges;
    if (use.index < 1 || use.index > static_cast<int>(edges.size()))
      in.fail("it names edge " + std::to_string(use.index) + " of a list of " + std::to_string(edges.size()));
    const int curve = edges[static_cast<std::size_t>(use.index) - 1].curve;
    append_model(curves_of(reading, curve, list, "curve of an edge"), use.forward, t, out.model);
  }
  if (!every_edge) out.parameter.clear();
  reading.mark(e, Disposition::read);
  return out;
}

}  // namespace

BoundaryCurves boundary_of(Reading& reading, const Entry& e, int surface) {
  switch (e.type) {
    case 141:
      return boundary_list(reading, e, surface);
    case 142:
      return curve_on_surface(reading, e, surface);
    case 508:
      return edge_loop(reading, e);
    default:
      throw InputError(reading.file.place(e) + "as a boundary of a face it is not read, must be 141, 142 or 508");
  }
}

}  // namespace toile::iges
