// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/map/nearest_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <tuple>

namespace toile {
namespace {

// By looking at every cell.
NearestCell by_search(int nu, int nv, const std::vector<char>& marked, double x, double y) {
  const int i = std::min(static_cast<int>(x), nu - 1), j = std::min(static_cast<int>(y), nv - 1);
  std::tuple<double, int, int, int> best{1e300, 0, -1, -1};
  for (int b = 0; b < nv; ++b)
    for (int a = 0; a < nu; ++a)
      if (marked[a + nu * b]) {
        const double du = a + 0.5 - x, dv = b + 0.5 - y;
        best = std::min(best, {du * du + dv * dv, std::max(std::abs(a - i), std::abs(b - j)), b, a});
      }
  return {std::get<3>(best), std::get<2>(best), std::get<0>(best)};
}

// Half-way places make ties; seldom marked cells make long ways.
TEST(NearestCells, AgreeWithASearchOfAllCells) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    SCOPED_TRACE(round);
    const int nu = 1 + static_cast<int>(random() % 12), nv = 1 + static_cast<int>(random() % 12);
    std::vector<char> marked(nu * nv);
    for (char& m : marked) m = random() % (round % 2 == 0 ? 2 : 15) == 0;
    std::vector<double> x, y;
    for (int k = 0; k <= 2 * nu; ++k) x.push_back(round % 3 == 0 ? k * 0.47 : k * 0.5);
    for (int k = 0; k <= 2 * nv; ++k) y.push_back(k * 0.5);
    const std::vector<NearestCell> found = nearest_cells(nu, nv, marked, x, y);
    for (std::size_t j = 0; j < y.size(); ++j)
      for (std::size_t i = 0; i < x.size(); ++i) {
        const NearestCell is = found[i + x.size() * j], should = by_search(nu, nv, marked, x[i], y[j]);
        if (std::ranges::find(marked, 1) == marked.end()) {
          EXPECT_EQ(is.i, -1);
          continue;
        }
        EXPECT_EQ(std::tuple(is.i, is.j), std::tuple(should.i, should.j)) << x[i] << ", " << y[j];
        EXPECT_DOUBLE_EQ(is.distance_squared, should.distance_squared);
      }
  }
}

}  // namespace
}  // namespace toile
