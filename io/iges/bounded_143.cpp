// SPDX-License-Identifier: GPL-3.0-or-later
// Entities 141 (boundary) and 143 (bounded surface). [IGES 5.3, 4.31, 4.33]
#include "io/iges/topology.h"

namespace toile::iges {

BoundaryList read_boundary_list(Parameters& in) {
  BoundaryList boundary;
  boundary.kind = in.integer("TYPE");
  boundary.preference = in.integer("PREF");
  boundary.surface = in.pointer("SPTR");
  const int n = in.integer("N");
  if (n < 1) in.fail("N is " + std::to_string(n) + ", must be positive");
  // SENSE and K of the last curve may be left out.
  in.expect(3LL * n - 2, std::to_string(n) + " curves");
  for (int i = 0; i < n; ++i) {
    BoundaryUse use;
    use.model = in.pointer("CRVPT");
    use.sense = in.integer("SENSE", 1);
    const int k = in.integer("K");
    if (k < 0) in.fail("K is " + std::to_string(k) + ", must not be negative");
    in.expect(k, std::to_string(k) + " parameter curves");
    for (int j = 0; j < k; ++j)
      if (const int curve = in.pointer("PSCPT"); curve != 0) use.parameter_curves.push_back(curve);
    boundary.curves.push_back(std::move(use));
  }
  return boundary;
}

void write(const BoundaryList& boundary, Record& out) {
  out.integer(boundary.kind).integer(boundary.preference).integer(boundary.surface);
  out.integer(static_cast<long long>(boundary.curves.size()));
  for (const BoundaryUse& use : boundary.curves) {
    out.integer(use.model).integer(use.sense).integer(static_cast<long long>(use.parameter_curves.size()));
    for (const int curve : use.parameter_curves) out.integer(curve);
  }
}

BoundedSurface read_bounded_surface(Parameters& in) {
  BoundedSurface face;
  face.kind = in.integer("TYPE");
  face.surface = in.pointer("SPTR");
  const int n = in.integer("N");
  if (n < 0) in.fail("N is " + std::to_string(n) + ", must not be negative");
  in.expect(n, std::to_string(n) + " boundaries");
  for (int i = 0; i < n; ++i) face.boundaries.push_back(in.pointer("BDPT"));
  return face;
}

void write(const BoundedSurface& face, Record& out) {
  out.integer(face.kind).integer(face.surface).integer(static_cast<long long>(face.boundaries.size()));
  for (const int boundary : face.boundaries) out.integer(boundary);
}

}  // namespace toile::iges
