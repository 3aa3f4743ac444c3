// SPDX-License-Identifier: GPL-3.0-or-later
// Where a Bezier span meets the lines u = c and v = c: exact signs, isolated roots, exact order.
#pragma once

#include <memory>
#include <vector>

#include "trimming/spans.h"
#include "trimming/topology.h"

namespace toile {

enum class Axis { u, v };

// The numerator of (coordinate - c) along a span: Bernstein coefficients w_i (x_i - c), whose signs are comparisons of
// the given doubles. The span must outlive the form. Throws GeometryError where c or a coefficient isn't finite.
class LineForm {
 public:
  LineForm(const TrimSpan& span, Axis axis, double c);

  const TrimSpan& span() const { return *span_; }
  Axis axis() const { return axis_; }
  double line() const { return line_; }
  int degree() const { return span_->degree; }
  double coordinate(int i) const;
  // Exact sign of coefficient i.
  int coefficient_sign(int i) const;
  // Coefficients rounded, the largest magnitude of them, and how far each may lie from the exact one.
  const std::array<double, max_degree + 1>& coefficients() const { return b_; }
  double magnitude() const { return magnitude_; }
  double coefficient_error() const;
  bool zero() const { return magnitude_ == 0; }
  // Exact sign just after s = 0 and just before s = 1 (0 for a span on the line).
  int sign_after_start() const;
  int sign_before_end() const;

 private:
  const TrimSpan* span_;
  Axis axis_;
  double line_;
  double magnitude_ = 0;
  std::array<double, max_degree + 1> b_;
};

class ExactFactor;

// A root of a LineForm in the open (0, 1).
//   (1) lo == hi: the root is this double exactly; else it is the only root in (lo, hi) and neither end is a root;
//   (2) crosses: the multiplicity is odd.
struct LineRoot {
  double lo = 0, hi = 0;
  bool crosses = true;
  std::shared_ptr<const ExactFactor> factor;  // square-free factor that has it as a simple root; null: the form itself
  double s() const { return lo + (hi - lo) / 2; }
  bool exact() const { return lo == hi; }
};

// Exact sign of the form at s in [0, 1].
int sign_at(const LineForm& form, double s, PredicateCounts& counts);

// All roots in the open (0, 1), ascending, their intervals disjoint and as narrow as plain arithmetic certifies. The
// form must not be zero. [Lane & Riesenfeld 1981: variation counting; Yun 1976: square-free factors where roots are
// multiple]
std::vector<LineRoot> roots(const LineForm& form, PredicateCounts& counts);

// Exact sign of `form` at a root of `of`, both on one span; narrows the root.
int sign_at_root(const LineForm& form, const LineForm& of, LineRoot& root, PredicateCounts& counts);

// Exact order (-1, 0, 1) of root a of f and root b of g, both on one span; narrows the roots.
int compare(const LineForm& f, LineRoot& a, const LineForm& g, LineRoot& b, PredicateCounts& counts);

// Exact sign of the area of the triangle a, b, c: 1 counter-clockwise, 0 on a line. Throws GeometryError for a corner
// that isn't finite.
int orientation(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c);

}  // namespace toile
