#include "analysis/linear/cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
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

// Both kinds of factor: small systems take the envelope, larger ones CHOLMOD.
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

}  // namespace
}  // namespace toile
