// SPDX-License-Identifier: GPL-3.0-or-later
// What crossings.h promises about the rounded coefficients of a span against a line.
#include <gmpxx.h>
#include <gtest/gtest.h>

#include <random>

#include "trimming/crossings.h"

namespace toile {
namespace {

TEST(LineForm, CoefficientsLieWithinTheirStatedError) {
  std::mt19937_64 random(1);
  const auto real = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  double nearest = 0;  // largest part of the stated error that was met
  for (int round = 0; round < 20000; ++round) {
    TrimSpan span;
    span.degree = 1 + round % 4;
    for (std::size_t i = 0; i <= static_cast<std::size_t>(span.degree); ++i) {
      span.u[i] = real(-1, 3);
      span.v[i] = 0;
      span.w[i] = round % 2 == 0 ? 1 : real(0.5, 2);
    }
    const LineForm form(span, Axis::u, real(0, 1));
    for (std::size_t i = 0; i <= static_cast<std::size_t>(span.degree); ++i) {
      const mpq_class exact = mpq_class(span.w[i]) * (mpq_class(span.u[i]) - mpq_class(form.line()));
      const double off = std::abs(mpq_class(exact - mpq_class(form.coefficients()[i])).get_d());
      EXPECT_LE(off, form.coefficient_error());
      nearest = std::max(nearest, off / form.coefficient_error());
    }
  }
  // Not so wide that signs are in doubt without need.
  EXPECT_GT(nearest, 0.4);
}

}  // namespace
}  // namespace toile
