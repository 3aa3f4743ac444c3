// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/build/independent_rows.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <random>

#include "support/allocation_count.h"

namespace toile {
namespace {

constexpr int points = 40;

AffineMap held_at(std::vector<int> fixed) {
  return AffineMap(AffineMap::identity(points), std::move(fixed), [](std::size_t, double) -> Eigen::Vector3d {
    return {0, 0, 0};
  });
}

// Rows of four neighbours, as places of a cubic have them.
std::vector<Candidate> some_places(int count, std::mt19937& random) {
  std::uniform_int_distribution<int> first(0, points - 4);
  std::uniform_real_distribution<double> share(0.05, 1);
  std::vector<Candidate> candidates;
  for (int k = 0; k < count; ++k) {
    Candidate c;
    const int from = first(random);
    for (int a = 0; a < 4; ++a) {
      c.row.index.push_back(from + a);
      c.row.value.push_back(share(random));
    }
    c.required = k % 5 == 3;
    candidates.push_back(c);
  }
  return candidates;
}

Eigen::VectorXd some_mass(int nodes, std::mt19937& random) {
  std::uniform_real_distribution<double> mass(0.1, 2);
  return Eigen::VectorXd::NullaryExpr(nodes, [&] { return mass(random); });
}

// The part of row k's inertia that the taken rows leave free, by a dense decomposition of theirs.
double left_free(const Eigen::MatrixXd& rows, const std::vector<Eigen::Index>& taken, Eigen::Index k) {
  const double all = rows.row(k).squaredNorm();
  if (taken.empty()) return 1;
  const Eigen::MatrixXd held = rows(taken, Eigen::all).transpose();
  const Eigen::VectorXd row = rows.row(k).transpose();
  return (row - held * held.colPivHouseholderQr().solve(row)).squaredNorm() / all;
}

TEST(IndependentRows, ARowIsTakenWhereEnoughOfItIsLeft) {
  for (const unsigned seed : {1u, 2u, 3u, 4u, 5u}) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const AffineMap map = held_at({7, 20, 21});
    const Eigen::VectorXd mass = some_mass(map.nodes(), random);
    const std::vector<Candidate> candidates = some_places(90, random);
    const std::vector<bool> taken = independent(candidates, map, mass);
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(90, points);
    for (std::size_t k = 0; k < candidates.size(); ++k)
      for (std::size_t a = 0; a < candidates[k].row.index.size(); ++a)
        rows(static_cast<Eigen::Index>(k), candidates[k].row.index[a]) = candidates[k].row.value[a];
    rows = rows * map.free_part().toDense() * mass.cwiseInverse().cwiseSqrt().asDiagonal();
    std::vector<Eigen::Index> held;
    for (const bool required : {true, false}) {
      for (std::size_t k = 0; k < candidates.size(); ++k) {
        if (candidates[k].required != required) continue;
        const double left = left_free(rows, held, static_cast<Eigen::Index>(k));
        EXPECT_EQ(taken[k], left >= (required ? 1e-3 : 0.2)) << "row " << k << ", left " << left;
        if (taken[k]) held.push_back(static_cast<Eigen::Index>(k));
      }
    }
    EXPECT_GT(held.size(), 10u);
    EXPECT_LE(held.size(), static_cast<std::size_t>(map.nodes()));
  }
}

TEST(IndependentRows, ThoseOfFixedPointsHoldNothing) {
  const AffineMap map = held_at({0, 1});
  const Candidate held{{{0, 1}, {0.5, 0.5}}, 0, true}, free{{{1, 2}, {0.5, 0.5}}, 0, false};
  EXPECT_EQ(independent({held, free}, map, Eigen::VectorXd::Ones(map.nodes())), (std::vector<bool>{false, true}));
}

// A toothed curve has many times as many places as the cells that it passes have nodes.
TEST(IndependentRows, PlacesBeyondTheRankAskForNoMemory) {
  if (!test::allocation_count()) GTEST_SKIP() << "this C library doesn't count";
  const AffineMap map = held_at({});
  std::vector<long> counts;
  for (const int count : {1000, 2000}) {
    std::mt19937 random(1);
    const Eigen::VectorXd mass = some_mass(points, random);
    const std::vector<Candidate> candidates = some_places(count, random);
    const long before = *test::allocation_count();
    const std::vector<bool> taken = independent(candidates, map, mass);
    counts.push_back(*test::allocation_count() - before);
    EXPECT_GE(std::ranges::count(taken, true), points / 2);
  }
  EXPECT_LE(counts[1], counts[0] + 20);
}

}  // namespace
}  // namespace toile
