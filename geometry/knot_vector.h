// SPDX-License-Identifier: GPL-3.0-or-later
// Knot vectors: the parameter line of every B-spline, its knots and spans.
#pragma once

#include <span>
#include <vector>

namespace toile {

struct Interval {
  double min = 0;
  double max = 0;
  double length() const { return max - min; }
  bool contains(double u) const { return min <= u && u <= max; }
};

// Largest degree that any curve or surface may have; basis values live on the stack.
inline constexpr int max_degree = 15;

// A degree and a nondecreasing sequence of finite knots, clamped or not.
//   (1) 0 <= degree <= max_degree; knots.size() = control_point_count() + degree + 1;
//   (2) no knot occurs more than degree + 1 times;
//   (3) domain() = [knots[p], knots[n]] has positive length.
// Throws GeometryError (with the offending knot) where these don't hold.
class KnotVector {
 public:
  KnotVector() : KnotVector(1, {0, 0, 1, 1}) {}
  KnotVector(int degree, std::vector<double> knots);

  int degree() const { return degree_; }
  int control_point_count() const { return static_cast<int>(knots_.size()) - degree_ - 1; }
  std::span<const double> knots() const { return knots_; }
  double operator[](int i) const { return knots_[static_cast<std::size_t>(i)]; }
  Interval domain() const;
  bool clamped() const;

  // Index i of the nonempty span with knots[i] <= u < knots[i+1]; the last span of the domain is closed.
  // A parameter outside the domain takes the first or last span (the polynomial continues).
  int find_span(double u) const;

  // Indices i of the nonempty spans [knots[i], knots[i+1]] of the domain, ascending.
  std::vector<int> spans() const;

  // Distinct knots in the closed domain, ascending: domain().min first, domain().max last; bitwise the given numbers.
  std::vector<double> breaks() const;

  // How often u occurs as a knot, compared bitwise; 0 for none.
  int multiplicity(double u) const;

  // Parameter where the control point's function is centred: mean of knots[i+1..i+p] (knot average for p = 0:
  // mid-span).
  double greville(int i) const;

  bool operator==(const KnotVector&) const = default;

 private:
  int degree_;
  std::vector<double> knots_;
};

// Clamped knots with `spans` equal spans on the domain.
KnotVector uniform_knots(int degree, int spans, Interval domain = {0, 1});

// Clamped knots of the given degree on ascending distinct breaks, every interior knot once.
KnotVector clamped_knots(int degree, std::span<const double> breaks);

}  // namespace toile
