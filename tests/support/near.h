// SPDX-License-Identifier: GPL-3.0-or-later
// The one comparison of the tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace toile::test {

// |actual - expected| <= max(rel * |expected|, abs_floor); NaN fails.
inline ::testing::AssertionResult near_rel(double actual, double expected, double rel, double abs_floor = 0) {
  const double bound = std::max(rel * std::abs(expected), abs_floor);
  const double error = std::abs(actual - expected);
  if (error <= bound) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << actual << " differs from " << expected << " by " << error << ", allowed "
                                       << bound;
}

}  // namespace toile::test

#define expect_near_rel(...) EXPECT_TRUE(::toile::test::near_rel(__VA_ARGS__))
