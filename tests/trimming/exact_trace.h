// SPDX-License-Identifier: GPL-3.0-or-later
// The topology of a trim by brute force in exact rational arithmetic: Sturm chains, bisection, rays in general
// position. Slow, and independent of trimming/: it shares the names of kinds with it and nothing else.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "trimming/topology.h"

namespace toile::test {

// A (rational) Bezier piece of a loop, in the loop's direction.
struct ExactPiece {
  std::vector<double> u, v, w;
  int degree() const { return static_cast<int>(u.size()) - 1; }
};
using ExactLoop = std::vector<ExactPiece>;

struct ExactEvent {
  PointKind kind = PointKind::crossing_u;
  int line_u = -1, line_v = -1;
  long double u = 0, v = 0;  // approximately
};

struct ExactTopology {
  std::vector<std::vector<ExactEvent>> events;  // of each loop, in its direction, from anywhere
  std::vector<CellKind> cells;                  // u fastest
  std::vector<VertexKind> vertices;
  std::vector<double> areas;  // of the material in each cell, to rounding
};

ExactTopology exact_topology(const std::vector<double>& lines_u, const std::vector<double>& lines_v,
                             const std::vector<ExactLoop>& loops);

// Nothing where the point lies on a loop.
std::optional<int> exact_winding(const std::vector<ExactLoop>& loops, double u, double v);

// Integral of f over [a, b] by 8 Gauss points, exact to degree 15; of a quotient, on parts that shrink to both ends.
long double integral(const std::function<long double(long double)>& f, long double a, long double b, bool quotient);

}  // namespace toile::test
