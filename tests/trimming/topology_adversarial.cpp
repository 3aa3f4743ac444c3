// SPDX-License-Identifier: GPL-3.0-or-later
// Random hard trims against exact arithmetic; `make verify` runs many more.
#include <gtest/gtest.h>

#include "trim_cases.h"

namespace toile::test {
namespace {

class HardRandomTrims : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(HardRandomTrims, AreDecidedRight) {
  for (std::uint64_t seed = GetParam(); seed < GetParam() + 500; ++seed) {
    const TrimCase made = random_trim_case(seed);
    ASSERT_EQ(wrong_decision(made, seed), "") << "seed " << seed << ": " << text_of(made);
  }
}
INSTANTIATE_TEST_SUITE_P(Seeds, HardRandomTrims, ::testing::Values(1, 501, 1001, 1501));

}  // namespace
}  // namespace toile::test
