// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/basis.h"

#include "random_geometry.h"
#include "support/near.h"

namespace toile {
namespace {

// The definition: one function by recursion, 0 / 0 = 0, functions of degree 0 being 1 on the named span alone.
double definition(const KnotVector& t, int i, int p, int span, double u) {
  if (p == 0) return i == span ? 1 : 0;
  double sum = 0;
  if (t[i + p] > t[i]) sum += (u - t[i]) / (t[i + p] - t[i]) * definition(t, i, p - 1, span, u);
  if (t[i + p + 1] > t[i + 1])
    sum += (t[i + p + 1] - u) / (t[i + p + 1] - t[i + 1]) * definition(t, i + 1, p - 1, span, u);
  return sum;
}

template <class Check>
void for_each_parameter(unsigned seed, int most_degree, Check&& check) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  test::Random random(seed);
  for (int degree = 0; degree <= most_degree; ++degree)
    for (auto ends : {test::Ends::clamped, test::Ends::unclamped}) {
      const KnotVector knots = test::random_knots(random, degree, 5, ends);
      for (double u : test::spread(knots.domain(), 41, knots.breaks())) {
        check(knots, u);
        if (::testing::Test::HasFatalFailure()) return;
      }
    }
}

TEST(Basis, ValuesFollowTheDefinition) {
  for_each_parameter(21, 6, [](const KnotVector& knots, double u) {
    const BasisValues basis = evaluate_basis(knots, u, 0);
    const int span = knots.find_span(u);
    ASSERT_EQ(basis.degree, knots.degree());
    ASSERT_EQ(basis.first, span - knots.degree());
    for (int j = 0; j <= knots.degree(); ++j)
      ASSERT_TRUE(
          test::near_rel(basis.value[0][j], definition(knots, basis.first + j, knots.degree(), span, u), 1e-13, 1e-15));
  });
}

TEST(Basis, SumsToOneAndDerivativesToZero) {
  for_each_parameter(22, max_degree, [](const KnotVector& knots, double u) {
    const BasisValues basis = evaluate_basis(knots, u, 2);
    for (int k = 0; k <= 2; ++k) {
      double sum = 0, size = 0;
      for (int j = 0; j <= basis.degree; ++j) {
        sum += basis.value[k][j];
        size += std::abs(basis.value[k][j]);
      }
      ASSERT_TRUE(test::near_rel(sum, k == 0 ? 1 : 0, 1e-14, 1e-14 * size));
    }
    for (int j = 0; j <= basis.degree; ++j) ASSERT_GE(basis.value[0][j], 0);
  });
}

TEST(Basis, DerivativesMatchCentralDifferences) {
  for_each_parameter(23, 7, [](const KnotVector& knots, double u) {
    const int span = knots.find_span(u);
    const double h = 1e-5;
    BasisValues at, low, high;
    evaluate_basis_on_span(knots, span, u, 2, at);
    evaluate_basis_on_span(knots, span, u - h, 1, low);
    evaluate_basis_on_span(knots, span, u + h, 1, high);
    for (int k = 1; k <= 2; ++k) {
      double size = 1;
      for (int j = 0; j <= at.degree; ++j) size = std::max(size, std::abs(at.value[k][j]));
      for (int j = 0; j <= at.degree; ++j)
        ASSERT_TRUE(
            test::near_rel(at.value[k][j], (high.value[k - 1][j] - low.value[k - 1][j]) / (2 * h), 0, 2e-7 * size))
            << "degree " << at.degree << " derivative " << k << " function " << j;
    }
  });
}

TEST(Basis, LowerOrdersAgreeBitwiseWithHigherOnes) {
  for_each_parameter(24, 5, [](const KnotVector& knots, double u) {
    const BasisValues two = evaluate_basis(knots, u, 2), one = evaluate_basis(knots, u, 1),
                      zero = evaluate_basis(knots, u, 0);
    for (int j = 0; j <= two.degree; ++j) {
      ASSERT_EQ(two.value[0][j], zero.value[0][j]);
      ASSERT_EQ(two.value[0][j], one.value[0][j]);
      ASSERT_EQ(two.value[1][j], one.value[1][j]);
    }
  });
}

TEST(Basis, ClampedEndsInterpolate) {
  const KnotVector knots(3, {0, 0, 0, 0, 0.4, 1, 1, 1, 1});
  const BasisValues start = evaluate_basis(knots, 0, 0), end = evaluate_basis(knots, 1, 0);
  EXPECT_EQ(start.first, 0);
  EXPECT_EQ(start.value[0][0], 1);
  EXPECT_EQ(end.first, 1);
  EXPECT_EQ(end.value[0][3], 1);
}

TEST(Basis, SidesAgreeAtAKnotUpToItsContinuity) {
  const KnotVector knots(3, {0, 0, 0, 0, 0.4, 0.4, 1, 1, 1, 1});  // C1 at 0.4
  BasisValues left, right;
  evaluate_basis_on_span(knots, 3, 0.4, 2, left);
  evaluate_basis_on_span(knots, 5, 0.4, 2, right);
  const auto value = [](const BasisValues& b, int k, int i) {
    return i >= b.first && i <= b.first + b.degree ? b.value[k][i - b.first] : 0.0;
  };
  double jump = 0;
  for (int i = 0; i < knots.control_point_count(); ++i) {
    for (int k = 0; k < 2; ++k) expect_near_rel(value(left, k, i), value(right, k, i), 1e-13, 1e-13);
    jump = std::max(jump, std::abs(value(left, 2, i) - value(right, 2, i)));
  }
  EXPECT_GT(jump, 1);  // the second derivative does jump
}

}  // namespace
}  // namespace toile
