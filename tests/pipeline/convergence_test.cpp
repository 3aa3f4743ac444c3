// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/study/convergence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "support/near.h"

namespace toile {
namespace {

Eigen::VectorXd plane(double x, double y) {
  Eigen::VectorXd v(2);
  v << x, y;
  return v;
}

struct Row {
  std::vector<double> h, error;
  std::vector<Eigen::VectorXd> value;
};

// limit + c h^p, in the plane.
Row row(double p, const std::vector<double>& sizes) {
  Row r{sizes, {}, {}};
  for (const double h : sizes) {
    r.value.push_back(plane(3, -1) + std::pow(h, p) * plane(0.3, 0.4));
    r.error.push_back(0.5 * std::pow(h, p));
  }
  return r;
}

TEST(Convergence, RichardsonFindsLimitAndOrderOfAPowerLaw) {
  for (const double p : {0.5, 1.0, 2.0, 3.7}) {
    const Row r = row(p, {0.4, 0.2, 0.13, 0.06});
    const auto limit = richardson(r.h, r.value, std::nullopt);
    ASSERT_TRUE(limit);
    EXPECT_NEAR((limit->value - plane(3, -1)).norm(), 0, 1e-10);
    EXPECT_NEAR(limit->order, p, 1e-7);
    EXPECT_NEAR(limit->uncertainty, 0, 1e-9);
  }
}

TEST(Convergence, RichardsonWithAGivenOrderTakesThreeValues) {
  const Row r = row(2, {0.4, 0.2, 0.1});
  EXPECT_FALSE(richardson(r.h, r.value, std::nullopt));
  const auto limit = richardson(r.h, r.value, 2.0);
  ASSERT_TRUE(limit);
  EXPECT_NEAR((limit->value - plane(3, -1)).norm(), 0, 1e-12);
  // A wrong order is betrayed by the distance between the two extrapolations.
  const auto wrong = richardson(r.h, r.value, 1.0);
  ASSERT_TRUE(wrong);
  // f3 + (f3 - f2) at h = 0.1, 0.2 has the error 0.5 (2 * 0.01 - 0.04) = -0.01; at 0.2, 0.4: -0.04.
  EXPECT_NEAR(wrong->uncertainty, 0.03, 1e-12);
}

TEST(Convergence, RichardsonRefusesWhatDoesNotConverge) {
  Row r = row(2, {0.4, 0.2, 0.1, 0.05});
  r.value[3] += plane(5, 0);
  EXPECT_FALSE(richardson(r.h, r.value, std::nullopt));
  EXPECT_FALSE(richardson({}, {}, 1.0));
}

TEST(Convergence, ObservedOrderIsTheSlope) {
  const Row r = row(2, {0.4, 0.2, 0.1});
  const auto order = observed_order(r.h, r.error, 0);
  ASSERT_TRUE(order);
  EXPECT_NEAR(order->slope, 2, 1e-12);
  EXPECT_NEAR(order->last, 2, 1e-12);
  EXPECT_EQ(order->points, 3);
}

TEST(Convergence, ErrorsBelowTheUncertaintyTellNoOrder) {
  Row r = row(2, {0.4, 0.2, 0.1});
  r.h.push_back(0.05);
  r.error.push_back(0.9e-3);  // noise
  const auto order = observed_order(r.h, r.error, 1e-3);
  ASSERT_TRUE(order);
  EXPECT_EQ(order->points, 3);
  EXPECT_NEAR(order->slope, 2, 1e-12);
  EXPECT_FALSE(observed_order(r.h, r.error, 1));
}

TEST(Convergence, MedianOfAnEvenNumberIsTheMeanOfTheMiddleTwo) {
  EXPECT_EQ(median({5, 1, 3}), 3);
  EXPECT_EQ(median({5, 1, 3, 4}), 3.5);
}

}  // namespace
}  // namespace toile
