// SPDX-License-Identifier: GPL-3.0-or-later
// Closed chains among the curves of one boundary, told by their ends.
#include <gtest/gtest.h>

#include "io/iges/closed_chains.h"

namespace toile::iges {
namespace {

using Ends = std::vector<std::array<Eigen::Vector3d, 2>>;
const Eigen::Vector3d a(0, 0, 0), b(1, 0, 0), c(1, 1, 0), d(5, 0, 0), e(6, 0, 0), f(6, 1, 0);

std::vector<std::size_t> begins(const Ends& ends) {
  return closed_chains(ends, 1e-6);
}

TEST(ClosedChains, OneLoopIsOneChainWhicheverWayItsCurvesRun) {
  EXPECT_EQ(begins({{a, b}, {b, c}, {c, a}}), (std::vector<std::size_t>{0}));
  EXPECT_EQ(begins({{b, a}, {b, c}, {c, a}}), (std::vector<std::size_t>{0}));
  EXPECT_EQ(begins({{a, b}, {c, b}, {c, a}}), (std::vector<std::size_t>{0}));
}

TEST(ClosedChains, CirclesBesideEachOtherAreOneEach) {
  EXPECT_EQ(begins({{a, a}, {d, d}, {f, f}}), (std::vector<std::size_t>{0, 1, 2}));
  EXPECT_EQ(begins({{a, b}, {b, c}, {c, a}, {e, d}, {f, e}, {f, d}}), (std::vector<std::size_t>{0, 3}));
}

TEST(ClosedChains, ASeamBetweenTwoCirclesKeepsThemTogether) {
  EXPECT_EQ(begins({{a, a}, {a, d}, {d, d}, {d, a}}), (std::vector<std::size_t>{0}));
}

TEST(ClosedChains, NothingIsPartedWhereAChainWouldStayOpen) {
  EXPECT_EQ(begins({{a, b}, {b, c}, {c, a}, {d, e}, {e, f}}), (std::vector<std::size_t>{0}));
  EXPECT_EQ(begins({{a, b}, {c, a}, {b, c}}), (std::vector<std::size_t>{0}));  // out of order
}

}  // namespace
}  // namespace toile::iges
