// SPDX-License-Identifier: GPL-3.0-or-later
// B-spline basis functions with derivatives. Nothing here allocates.
#pragma once

#include <array>

#include "geometry/knot_vector.h"

namespace toile {

// Nonzero B-spline functions at a parameter and their derivatives up to order 2.
// value[k][j] is the k-th derivative of the function of control point first + j, j = 0..degree.
//   (1) value[0] sums to 1, every later row to 0;
//   (2) rows above the order asked for are unset.
struct BasisValues {
  int degree = 0;
  int first = 0;
  std::array<std::array<double, max_degree + 1>, 3> value;
};

// Basis at u on the span that holds u (find_span), or on a named span (polynomial continued where u lies outside it).
// 0 <= order <= 2. [Piegl & Tiller 1997, A2.3]
void evaluate_basis(const KnotVector& knots, double u, int order, BasisValues& out);
void evaluate_basis_on_span(const KnotVector& knots, int span, double u, int order, BasisValues& out);
BasisValues evaluate_basis(const KnotVector& knots, double u, int order);

}  // namespace toile
