// SPDX-License-Identifier: GPL-3.0-or-later
// Entities 144 (trimmed surface) and 142 (curve on a surface). [IGES 5.3, 4.32, 4.34]
#include "io/iges/entity.h"

namespace toile::iges {

Boundary read_boundary(Parameters& in) {
  Boundary b;
  b.creation = in.integer("CRTN");
  b.surface = in.pointer("SPTR");
  b.parameter_curve = in.pointer("BPTR");
  b.model_curve = in.pointer("CPTR");
  b.preference = in.integer("PREF");
  return b;
}

void write(const Boundary& b, Record& out) {
  out.integer(b.creation).integer(b.surface).integer(b.parameter_curve).integer(b.model_curve).integer(b.preference);
}

Face read_face(Parameters& in) {
  Face face;
  face.surface = in.pointer("PTS");
  const int n1 = in.integer("N1");
  const int n2 = in.integer("N2");
  face.outer = in.pointer("PTO");
  face.outer_is_missing = n1 != 0 && face.outer == 0;
  face.outer_was_denied = n1 == 0 && face.outer != 0;
  if (n2 < 0) in.fail("N2 is " + std::to_string(n2) + ", must not be negative");
  in.expect(n2, std::to_string(n2) + " inner boundaries");
  for (int i = 0; i < n2; ++i) face.holes.push_back(in.pointer("PTI"));
  return face;
}

void write(const Face& face, Record& out) {
  out.integer(face.surface).integer(face.outer != 0 ? 1 : 0).integer(static_cast<long long>(face.holes.size()));
  out.integer(face.outer);
  for (int hole : face.holes) out.integer(hole);
}

}  // namespace toile::iges
