// SPDX-License-Identifier: GPL-3.0-or-later
// What a row of finer and finer runs says: the limit, the order, the middle of repeats.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace toile {

struct Limit {
  Eigen::VectorXd value;
  double uncertainty = 0;  // largest norm by which the limit may be off, as its own history suggests
  double order = 0;        // assumed or observed
};

// Limit of f(h) = f + c h^p from the three finest values, p observed unless given (then from the two finest).
// `h` falls; the values belong to it, the last is the finest. The uncertainty is the distance to the same extrapolation
// without the finest value.
//   (1) exact, with uncertainty 0, for values that follow the law;
//   (2) nothing where one value more than the extrapolation takes isn't there, or where the differences don't shrink.
// [Roache 1998, ch. 5]
std::optional<Limit> richardson(std::span<const double> h, std::span<const Eigen::VectorXd> values,
                                std::optional<double> order);

struct ObservedOrder {
  double slope = 0;  // least squares of log error over log h
  double last = 0;   // between the two finest
  int points = 0;
};

// Of the points with error above `floor` (errors below it say nothing but the reference's own). `h` falls.
// Nothing with fewer than two such points of different h.
std::optional<ObservedOrder> observed_order(std::span<const double> h, std::span<const double> error, double floor);

// The mean of the two middle ones where their number is even. Not of nothing.
double median(std::vector<double> values);

}  // namespace toile
