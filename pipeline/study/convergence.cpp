// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/study/convergence.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace toile {
namespace {

// p of |f1 - f2| / |f2 - f3| = (h1^p - h2^p) / (h2^p - h3^p), whose right side rises with p.
std::optional<double> order_of(double h1, double h2, double h3, double ratio) {
  const auto right = [&](double p) { return (std::pow(h1 / h2, p) - 1) / (1 - std::pow(h3 / h2, p)); };
  constexpr double smallest = 0.01, largest = 20;
  double low = smallest, high = largest;
  if (!(right(low) < ratio && ratio < right(high))) return std::nullopt;
  for (int k = 0; k < 100; ++k) (right((low + high) / 2) < ratio ? low : high) = (low + high) / 2;
  return (low + high) / 2;
}

std::optional<Limit> extrapolate(std::span<const double> h, std::span<const Eigen::VectorXd> f,
                                 std::optional<double> order) {
  const std::size_t n = h.size(), needed = order ? 2 : 3;
  if (n < needed) return std::nullopt;
  const Eigen::VectorXd step = f[n - 1] - f[n - 2];
  if (step.isZero(0)) return Limit{f[n - 1], 0, order.value_or(0)};
  if (!order) order = order_of(h[n - 3], h[n - 2], h[n - 1], (f[n - 2] - f[n - 3]).norm() / step.norm());
  if (!order) return std::nullopt;
  return Limit{f[n - 1] + step / (std::pow(h[n - 2] / h[n - 1], *order) - 1), 0, *order};
}

}  // namespace

std::optional<Limit> richardson(std::span<const double> h, std::span<const Eigen::VectorXd> values,
                                std::optional<double> order) {
  assert(h.size() == values.size() && std::ranges::is_sorted(h, std::greater<>{}));
  std::optional<Limit> limit = extrapolate(h, values, order);
  if (!limit) return std::nullopt;
  const auto before = extrapolate(h.first(h.size() - 1), values.first(values.size() - 1), order);
  if (!before) return std::nullopt;
  limit->uncertainty = (limit->value - before->value).norm();
  return limit;
}

std::optional<ObservedOrder> observed_order(std::span<const double> h, std::span<const double> error, double floor) {
  assert(h.size() == error.size());
  std::vector<Eigen::Vector2d> points;
  for (std::size_t k = 0; k < h.size(); ++k) {
    if (error[k] > 0 && error[k] >= floor) points.emplace_back(std::log(h[k]), std::log(error[k]));
  }
  if (points.size() < 2) return std::nullopt;
  Eigen::Vector2d mean(0, 0);
  for (const Eigen::Vector2d& p : points) mean += p / static_cast<double>(points.size());
  double xx = 0, xy = 0;
  for (const Eigen::Vector2d& p : points) {
    xx += (p.x() - mean.x()) * (p.x() - mean.x());
    xy += (p.x() - mean.x()) * (p.y() - mean.y());
  }
  const Eigen::Vector2d last = points[points.size() - 1] - points[points.size() - 2];
  if (!(xx > 0) || last.x() == 0) return std::nullopt;
  return ObservedOrder{xy / xx, last.y() / last.x(), static_cast<int>(points.size())};
}

double median(std::vector<double> values) {
  assert(!values.empty());
  std::ranges::sort(values);
  const std::size_t n = values.size();
  return 0.5 * (values[(n - 1) / 2] + values[n / 2]);
}

}  // namespace toile
