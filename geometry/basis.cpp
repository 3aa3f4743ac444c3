// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/basis.h"

#include <cassert>

namespace toile {
namespace {

// Values of degree p from those of degree p - 1 on the span [t[0], t[1]] (Cox - de Boor): in has p entries, out p + 1.
inline void raise_degree(const double* t, double u, int p, const double* in, double* out) {
  double carried = 0;
  for (int r = 0; r < p; ++r) {
    const double left = t[r + 1 - p], right = t[r + 1];
    const double part = in[r] / (right - left);
    out[r] = carried + (right - u) * part;
    carried = (u - left) * part;
  }
  out[p] = carried;
}

// Derivatives of functions of degree p from values (or derivatives) of those of degree p - 1.
inline void differentiate(const double* t, int p, const double* in, double* out) {
  double carried = 0;
  for (int r = 0; r < p; ++r) {
    const double part = p * in[r] / (t[r + 1] - t[r + 1 - p]);
    out[r] = carried - part;
    carried = part;
  }
  out[p] = carried;
}

}  // namespace

void evaluate_basis_on_span(const KnotVector& knots, int span, double u, int order, BasisValues& out) {
  assert(0 <= order && order <= 2);
  const int p = knots.degree();
  assert(p <= span && span < knots.control_point_count() && knots[span] < knots[span + 1]);
  const double* t = knots.knots().data() + span;
  out.degree = p;
  out.first = span - p;

  std::array<std::array<double, max_degree + 1>, 2> row;
  double lower[max_degree + 1];  // values of degree p - 2
  double lower_d1[max_degree + 1];
  int current = 0;
  row[0][0] = 1;
  for (int k = 1; k < p; ++k) {
    if (order == 2 && k == p - 1)
      for (int j = 0; j < k; ++j) lower[j] = row[current][j];
    raise_degree(t, u, k, row[current].data(), row[1 - current].data());
    current = 1 - current;
  }
  // row[current] holds the values of degree max(p - 1, 0).
  if (p == 0) {
    out.value[0][0] = 1;
    for (int k = 1; k <= order; ++k) out.value[k][0] = 0;
    return;
  }
  raise_degree(t, u, p, row[current].data(), out.value[0].data());
  if (order >= 1) differentiate(t, p, row[current].data(), out.value[1].data());
  if (order == 2) {
    if (p == 1) {
      out.value[2][0] = out.value[2][1] = 0;
    } else {
      differentiate(t, p - 1, lower, lower_d1);
      differentiate(t, p, lower_d1, out.value[2].data());
    }
  }
}

void evaluate_basis(const KnotVector& knots, double u, int order, BasisValues& out) {
  evaluate_basis_on_span(knots, knots.find_span(u), u, order, out);
}

BasisValues evaluate_basis(const KnotVector& knots, double u, int order) {
  BasisValues out;
  evaluate_basis(knots, u, order, out);
  return out;
}

}  // namespace toile
