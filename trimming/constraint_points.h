// SPDX-License-Identifier: GPL-3.0-or-later
// The points at which strain is limited: knot-mesh vertices in the material and the meetings of trims with knot lines
// [Peng & Zheng 2022, 3.4, Fig. 3]; and the corners of trims between them.
#pragma once

#include <string>
#include <vector>

#include "trimming/topology.h"

namespace toile {

struct ConstraintPoint {
  PointKind kind = PointKind::vertex;
  double u = 0, v = 0;        // knot coordinates bitwise
  int loop = -1, curve = -1;  // the file's numbers; -1 for an inner vertex
  double t = 0;               // on the file's curve
  bool used = true;           // false: the projection leaves it out, `why` says the reason
  std::string why;
};

// All of them, inner vertices first (u fastest), then events in the order of the loops, then corners likewise; none
// twice. A corner is where a trim turns on the surface by more than 30 degrees and no event stands. The joint of two
// curves is listed on the later one in the file's order, as events are.
std::vector<ConstraintPoint> constraint_points(const TrimmedSurface& surface, const TrimTopology& topology);
// The same in one call: loops validated as validate_loops() does, traced, listed. Throws what that throws.
std::vector<ConstraintPoint> constraint_points(TrimmedSurface surface);

}  // namespace toile
