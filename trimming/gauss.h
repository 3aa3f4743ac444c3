// SPDX-License-Identifier: GPL-3.0-or-later
// Gauss-Legendre rules on [-1, 1].
#pragma once

#include <vector>

namespace toile {

// n nodes, ascending, exact for polynomials of degree 2n - 1. Nodes and weights carry the full precision of long
// double; x and w are those rounded.
struct GaussRule {
  std::vector<double> x, w;
  std::vector<long double> node, weight;
  int size() const { return static_cast<int>(x.size()); }
};

inline constexpr int max_gauss_points = 64;

// 1 <= n <= max_gauss_points.
const GaussRule& gauss_rule(int n);

}  // namespace toile
