// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/linear/cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cstdlib>
#include <limits>
#include <memory>
#include <random>

#include "support/near.h"

namespace toile {
namespace {

struct System {
  SparsePattern pattern;
  std::vector<double> values;
  Eigen::MatrixXd dense;
};

// Diagonally dominant with about `links` random neighbours a row; the last three rows stand alone.
System random_system(int n, int links, unsigned seed) {
  std::mt19937 rng(seed);
  std::uniform_int_distribution<int> pick(0, n - 4);
  std::uniform_real_distribution<double> draw(-1, 1);
  System s;
  s.dense = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < n - 3; ++i)
    for (int k = 0; k < links; ++k)
      if (const int j = pick(rng); j != i) s.dense(i, j) = s.dense(j, i) = draw(rng);
  for (int i = 0; i < n; ++i) s.dense(i, i) = 1 + s.dense.row(i).cwiseAbs().sum();
  s.pattern.column_start.push_back(0);
  for (int c = 0; c < n; ++c) {
    for (int r = c; r < n; ++r)
      if (s.dense(r, c) != 0) s.pattern.row.push_back(r), s.values.push_back(s.dense(r, c));
    s.pattern.column_start.push_back(static_cast<int>(s.pattern.row.size()));
  }
  return s;
}

double solve_error(Cholesky& factor, const System& s) {
  const Eigen::VectorXd expected = Eigen::VectorXd::LinSpaced(s.dense.rows(), -1, 2);
  const Eigen::VectorXd rhs = s.dense * expected;
  Eigen::VectorXd x(rhs.size());
  factor.solve(rhs, x);
  return (x - expected).cwiseAbs().maxCoeff();
}

// What the diagonal of row c may at least be: a^T A^-1 a of the rest.
double singular_diagonal(const Eigen::MatrixXd& matrix, int c) {
  Eigen::MatrixXd rest = matrix;
  Eigen::VectorXd row = matrix.col(c);
  row[c] = 0;
  rest.row(c).setZero();
  rest.col(c).setZero();
  rest(c, c) = 1;
  return row.dot(rest.ldlt().solve(row));
}

// Both kinds of factor: small systems take the envelope, larger ones supernodes.
class CholeskyOfSize : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Sizes, CholeskyOfSize, ::testing::Values(4, 60, 300, 1100));

TEST_P(CholeskyOfSize, SolvesWhatTheDenseMatrixSays) {
  const System s = random_system(GetParam(), 3, 11);
  Cholesky factor(s.pattern);
  ASSERT_TRUE(factor.factorise(s.values));
  EXPECT_LT(solve_error(factor, s), 1e-12);
  EXPECT_GE(factor.factor_nonzeros(), s.pattern.row.size());
}

TEST_P(CholeskyOfSize, RefactorsWithNewValuesOnTheSamePattern) {
  System s = random_system(GetParam(), 3, 12);
  Cholesky factor(s.pattern);
  ASSERT_TRUE(factor.factorise(s.values));
  for (double& value : s.values) value *= 3;
  s.dense *= 3;
  ASSERT_TRUE(factor.factorise(s.values));
  EXPECT_LT(solve_error(factor, s), 1e-12);
}

TEST_P(CholeskyOfSize, SaysWhereAMatrixIsNotPositiveDefiniteAndRecovers) {
  System s = random_system(GetParam(), 3, 13);
  Cholesky factor(s.pattern);
  std::vector<double> bad = s.values;
  const int middle = GetParam() / 2;
  bad[s.pattern.column_start[middle]] = -1;  // the diagonal comes first in its column
  EXPECT_FALSE(factor.factorise(bad));
  ASSERT_TRUE(factor.factorise(s.values));
  EXPECT_LT(solve_error(factor, s), 1e-12);
}

TEST_P(CholeskyOfSize, SameInputGivesTheSameBits) {
  const System s = random_system(GetParam(), 4, 14);
  Cholesky a(s.pattern), b(s.pattern);
  ASSERT_TRUE(a.factorise(s.values));
  ASSERT_TRUE(b.factorise(s.values));
  ASSERT_TRUE(b.factorise(s.values));
  Eigen::VectorXd rhs = Eigen::VectorXd::LinSpaced(GetParam(), 1, 2), xa(rhs.size()), xb(rhs.size());
  a.solve(rhs, xa);
  b.solve(rhs, xb);
  EXPECT_EQ(xa, xb);
}

TEST_P(CholeskyOfSize, ThreadsAndTheirNumberDontShow) {
  const System s = random_system(GetParam(), 4, 15);
  const Eigen::VectorXd rhs = Eigen::VectorXd::LinSpaced(GetParam(), 1, 2);
  const auto solution = [&](int threads) {
    Cholesky factor(s.pattern);
    Workers workers(threads);
    if (threads > 1) factor.use_threads(&workers);
    EXPECT_TRUE(factor.factorise(s.values));
    Eigen::VectorXd x(rhs.size());
    factor.solve(rhs, x);
    return x;
  };
  const Eigen::VectorXd one = solution(1);
  for (const int threads : {2, 3, 7}) EXPECT_EQ(solution(threads), one) << threads;
}

TEST_P(CholeskyOfSize, NoNumberIsNotPositive) {
  const System s = random_system(GetParam(), 3, 16);
  Cholesky factor(s.pattern);
  for (const std::size_t place : {std::size_t{0}, s.values.size() / 2, s.values.size() - 1}) {
    std::vector<double> bad = s.values;
    bad[place] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(factor.factorise(bad)) << place;
  }
}

// Two unknowns at each point of a grid, each with its eight neighbours: subtrees, their ancestors, wide fronts.
TEST(Cholesky, SolvesAGridByOneThreadAndThree) {
  constexpr int side = 90, n = 2 * side * side;
  std::mt19937 rng(17);
  std::uniform_real_distribution<double> draw(-1, 1);
  SparsePattern pattern;
  std::vector<double> values;
  pattern.column_start.push_back(0);
  for (int c = 0; c < n; ++c) {
    const int x = c / 2 % side, y = c / 2 / side;
    for (int r = c; r < std::min(n, c + 2 * side + 6); ++r) {
      if (std::abs(r / 2 % side - x) > 1 || r / 2 / side - y > 1) continue;
      pattern.row.push_back(r);
      values.push_back(r == c ? 18 : draw(rng));
    }
    pattern.column_start.push_back(static_cast<int>(pattern.row.size()));
  }
  const Eigen::VectorXd expected = Eigen::VectorXd::LinSpaced(n, -1, 2);
  Eigen::VectorXd rhs = Eigen::VectorXd::Zero(n), one(n), three(n);
  for (int c = 0; c < n; ++c)
    for (int e = pattern.column_start[c]; e < pattern.column_start[c + 1]; ++e) {
      rhs[pattern.row[e]] += values[e] * expected[c];
      if (pattern.row[e] != c) rhs[c] += values[e] * expected[pattern.row[e]];
    }
  Cholesky factor(pattern);
  ASSERT_TRUE(factor.factorise(values));
  factor.solve(rhs, one);
  EXPECT_LT((one - expected).cwiseAbs().maxCoeff(), 1e-11);
  Workers workers(3);
  factor.use_threads(&workers);
  ASSERT_TRUE(factor.factorise(values));
  factor.solve(rhs, three);
  EXPECT_EQ(one, three);
}

// Two factors that share nothing but the ordering: near-singular matrices too, where both lose the same digits.
TEST_P(CholeskyOfSize, AgreesWithCholmod) {
  for (const double smallest : {1.0, 1e-6, 1e-10}) {
    System s = random_system(GetParam(), 3, 18);
    // One pivot is `smallest`: the diagonal comes first in its column.
    const int n = GetParam(), c = n / 2;
    s.values[static_cast<std::size_t>(s.pattern.column_start[c])] = s.dense(c, c) =
        singular_diagonal(s.dense, c) + smallest;
    Cholesky ours(s.pattern, CholeskyNumbers::ours), oracle(s.pattern, CholeskyNumbers::cholmod);
    ASSERT_TRUE(ours.factorise(s.values));
    ASSERT_TRUE(oracle.factorise(s.values));
    const Eigen::VectorXd rhs = Eigen::VectorXd::LinSpaced(n, 1, 2);
    Eigen::VectorXd a(n), b(n);
    ours.solve(rhs, a);
    oracle.solve(rhs, b);
    EXPECT_LT((a - b).norm(), 1e-13 / std::min(1.0, smallest) * a.norm()) << smallest;
    EXPECT_LT((s.dense * a - rhs).norm(), 1e-11 * (s.dense.norm() * a.norm() + rhs.norm())) << smallest;
  }
}

TEST_P(CholeskyOfSize, BothSayWhereAMatrixIsIndefinite) {
  const System s = random_system(GetParam(), 3, 19);
  for (const CholeskyNumbers numbers : {CholeskyNumbers::ours, CholeskyNumbers::cholmod}) {
    Cholesky factor(s.pattern, numbers);
    std::vector<double> bad = s.values;
    bad[static_cast<std::size_t>(s.pattern.column_start[GetParam() / 3])] *= -1;
    EXPECT_FALSE(factor.factorise(bad));
    ASSERT_TRUE(factor.factorise(s.values));
    EXPECT_LT(solve_error(factor, s), 1e-12);
  }
}

}  // namespace
}  // namespace toile
