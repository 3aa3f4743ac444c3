// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/knot_vector.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "geometry/error.h"
#include "geometry/text.h"

namespace toile {
namespace {

void check(int degree, const std::vector<double>& knots) {
  if (degree < 0 || degree > max_degree)
    throw GeometryError("degree " + std::to_string(degree) + " is outside 0 to " + std::to_string(max_degree));
  const int count = static_cast<int>(knots.size());
  if (count < 2 * (degree + 1))
    throw GeometryError("degree " + std::to_string(degree) + " needs at least " + std::to_string(2 * (degree + 1)) +
                        " knots, there are " + std::to_string(count));
  int run = 0;
  for (int i = 0; i < count; ++i) {
    if (!std::isfinite(knots[i])) throw GeometryError("knot " + std::to_string(i) + " is not finite");
    if (i > 0 && knots[i] < knots[i - 1])
      throw GeometryError("knot " + std::to_string(i) + " is " + text(knots[i]) + ", less than its predecessor " +
                          text(knots[i - 1]));
    run = i > 0 && knots[i] == knots[i - 1] ? run + 1 : 1;
    if (run > degree + 1)
      throw GeometryError("knot " + std::to_string(i) + " = " + text(knots[i]) +
                          " occurs more than degree + 1 = " + std::to_string(degree + 1) + " times");
  }
  if (!(knots[degree] < knots[count - degree - 1]))
    throw GeometryError("the domain from knot " + std::to_string(degree) + " to knot " +
                        std::to_string(count - degree - 1) + " is empty at " + text(knots[degree]));
  if (!std::isfinite(knots[count - 1] - knots[0]))
    throw GeometryError("knots 0 and " + std::to_string(count - 1) + " are too far apart: " + text(knots[0]) + ", " +
                        text(knots[count - 1]));
}

}  // namespace

KnotVector::KnotVector(int degree, std::vector<double> knots) : degree_(degree), knots_(std::move(knots)) {
  check(degree_, knots_);
}

Interval KnotVector::domain() const {
  return {knots_[degree_], knots_[control_point_count()]};
}

bool KnotVector::clamped() const {
  return knots_.front() == knots_[degree_] && knots_.back() == knots_[control_point_count()];
}

int KnotVector::find_span(double u) const {
  const auto first = knots_.begin() + degree_;
  const auto last = knots_.begin() + control_point_count();  // end of the domain
  // The clamped parameter lies in [min, max); NaN takes the first span.
  const double inside = u > *first ? u : *first;
  const auto upper = inside < *last ? std::upper_bound(first, last, inside) : std::lower_bound(first, last, *last);
  return static_cast<int>(upper - knots_.begin()) - 1;
}

std::vector<int> KnotVector::spans() const {
  std::vector<int> result;
  for (int i = degree_; i < control_point_count(); ++i)
    if (knots_[i] < knots_[i + 1]) result.push_back(i);
  return result;
}

std::vector<double> KnotVector::breaks() const {
  std::vector<double> result(knots_.begin() + degree_, knots_.begin() + control_point_count() + 1);
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

int KnotVector::multiplicity(double u) const {
  const auto range = std::equal_range(knots_.begin(), knots_.end(), u);
  return static_cast<int>(range.second - range.first);
}

double KnotVector::greville(int i) const {
  if (degree_ == 0) return knots_[i] + (knots_[i + 1] - knots_[i]) / 2;
  // Relative to the first knot, so that a run of equal knots gives that knot bitwise.
  double sum = 0;
  for (int j = 2; j <= degree_; ++j) sum += knots_[i + j] - knots_[i + 1];
  return knots_[i + 1] + sum / degree_;
}

KnotVector uniform_knots(int degree, int spans, Interval domain) {
  if (spans < 1) throw GeometryError("a knot vector needs at least one span, asked for " + std::to_string(spans));
  std::vector<double> breaks(spans + 1);
  for (int i = 0; i <= spans; ++i) breaks[i] = domain.min + domain.length() * i / spans;
  breaks.back() = domain.max;
  return clamped_knots(degree, breaks);
}

KnotVector clamped_knots(int degree, std::span<const double> breaks) {
  if (breaks.size() < 2) throw GeometryError("a knot vector needs at least two breaks");
  for (std::size_t i = 1; i < breaks.size(); ++i)
    if (!(breaks[i - 1] < breaks[i]))
      throw GeometryError("break " + std::to_string(i) + " is " + text(breaks[i]) +
                          ", not greater than its predecessor " + text(breaks[i - 1]));
  std::vector<double> knots(static_cast<std::size_t>(std::max(degree, 0)), breaks.front());
  knots.insert(knots.end(), breaks.begin(), breaks.end());
  knots.insert(knots.end(), static_cast<std::size_t>(std::max(degree, 0)), breaks.back());
  return {degree, std::move(knots)};
}

}  // namespace toile
