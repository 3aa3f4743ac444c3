// SPDX-License-Identifier: GPL-3.0-or-later
// Random hard trims against exact arithmetic; `make verify` runs many more.
#include <gtest/gtest.h>

#include "trim_cases.h"

namespace toile::test {
namespace {

// Under sanitizers a case takes some thirty times as long, and what they look for needs no thousand of them.
#ifdef __SANITIZE_ADDRESS__
constexpr std::uint64_t count = 25;
#else
constexpr std::uint64_t count = 500;
#endif

class HardRandomTrims : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(HardRandomTrims, AreDecidedRight) {
  for (std::uint64_t seed = GetParam(); seed < GetParam() + count; ++seed) {
    const TrimCase made = random_trim_case(seed);
    ASSERT_EQ(wrong_decision(made, seed), "") << "seed " << seed << ": " << text_of(made);
  }
}
INSTANTIATE_TEST_SUITE_P(Seeds, HardRandomTrims, ::testing::Values(1, 501, 1001, 1501));

}  // namespace
}  // namespace toile::test
