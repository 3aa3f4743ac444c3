// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/knot_vector.h"

#include <cmath>
#include <limits>

#include "expect_error.h"
#include "random_geometry.h"
#include "support/near.h"

namespace toile {
namespace {

using test::expect_geometry_error;

TEST(KnotVector, RefusesWhatBreaksItsLawsAndNamesThePlace) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_geometry_error([] { KnotVector(-1, {0, 1}); }, "degree -1");
  expect_geometry_error([] { KnotVector(16, std::vector<double>(40, 0.0)); }, "degree 16");
  expect_geometry_error([] { KnotVector(2, {0, 0, 1, 1}); }, "6", "4");
  expect_geometry_error([] { KnotVector(1, {0, 0, 0.5, 0.25, 1, 1}); }, "knot 3", "0.25", "0.5");
  expect_geometry_error([=] { KnotVector(1, {0, 0, nan, 1, 1}); }, "knot 2", "finite");
  expect_geometry_error([] { KnotVector(1, {0, 0, 0.5, 0.5, 0.5, 1, 1}); }, "0.5", "degree + 1");
  expect_geometry_error([] { KnotVector(1, {0, 1, 1, 2}); }, "empty", "1");
}

TEST(KnotVector, SpanHoldsItsParameter) {
  SCOPED_TRACE("seed 11");
  test::Random random(11);
  for (int trial = 0; trial < 60; ++trial) {
    const auto ends = trial % 2 ? test::Ends::clamped : test::Ends::unclamped;
    const KnotVector knots = test::random_knots(random, trial % 6, random.integer(1, 6), ends);
    const Interval domain = knots.domain();
    for (double u : test::spread(domain, 57, knots.breaks())) {
      const int i = knots.find_span(u);
      ASSERT_LE(knots.degree(), i);
      ASSERT_LT(i, knots.control_point_count());
      ASSERT_LT(knots[i], knots[i + 1]);
      ASSERT_LE(knots[i], u);
      if (u < domain.max)
        ASSERT_LT(u, knots[i + 1]);
      else
        ASSERT_EQ(knots[i + 1], domain.max);
    }
    const std::vector<int> spans = knots.spans();
    EXPECT_EQ(knots.find_span(domain.min - 1), spans.front());
    EXPECT_EQ(knots.find_span(domain.max + 1), spans.back());
    EXPECT_EQ(knots.find_span(std::numeric_limits<double>::quiet_NaN()), spans.front());
    const std::vector<double> breaks = knots.breaks();
    ASSERT_EQ(breaks.size(), spans.size() + 1);
    for (std::size_t s = 0; s < spans.size(); ++s) {
      EXPECT_EQ(knots[spans[s]], breaks[s]);
      EXPECT_EQ(knots[spans[s] + 1], breaks[s + 1]);
    }
  }
}

TEST(KnotVector, CountsMultiplicitiesBitwise) {
  const KnotVector knots(2, {0, 0, 0, 0.3, 0.3, std::nextafter(0.3, 1), 1, 1, 1});
  EXPECT_EQ(knots.multiplicity(0), 3);
  EXPECT_EQ(knots.multiplicity(0.3), 2);
  EXPECT_EQ(knots.multiplicity(std::nextafter(0.3, 1)), 1);
  EXPECT_EQ(knots.multiplicity(0.5), 0);
  EXPECT_TRUE(knots.clamped());
  EXPECT_FALSE(KnotVector(2, {-2, -1, 0, 1, 2, 3}).clamped());
}

TEST(KnotVector, GrevilleAbscissaeReproduceTheParameter) {
  SCOPED_TRACE("seed 12");
  test::Random random(12);
  for (int degree = 1; degree <= 7; ++degree) {
    const KnotVector knots = test::random_knots(random, degree, 4, test::Ends::unclamped);
    Curve2::Points points = Curve2::Points::Zero(2, knots.control_point_count());
    for (int i = 0; i < points.cols(); ++i) points(0, i) = knots.greville(i);
    const Curve2 curve(knots, points);
    for (double u : test::spread(knots.domain(), 41)) expect_near_rel(curve(u).x(), u, 1e-14, 1e-14);
  }
  EXPECT_EQ(KnotVector(3, {0.1, 0.1, 0.1, 0.1, 0.7, 0.7, 0.7, 0.7}).greville(0), 0.1);
  EXPECT_EQ(KnotVector(0, {0, 1, 3}).greville(1), 2);
}

TEST(KnotVector, UniformAndClampedKnotsHaveTheSpansAskedFor) {
  const KnotVector uniform = uniform_knots(3, 7, {-1, 2.5});
  EXPECT_EQ(uniform.spans().size(), 7u);
  EXPECT_EQ(uniform.control_point_count(), 10);
  EXPECT_EQ(uniform.domain().min, -1);
  EXPECT_EQ(uniform.domain().max, 2.5);
  EXPECT_TRUE(uniform.clamped());
  const std::vector<double> breaks = {0, 0.1, 0.7};
  EXPECT_EQ(clamped_knots(2, breaks), KnotVector(2, {0, 0, 0, 0.1, 0.7, 0.7, 0.7}));
  EXPECT_EQ(clamped_knots(2, breaks).breaks(), breaks);
  expect_geometry_error([] { uniform_knots(2, 0); }, "at least one span", "0");
  expect_geometry_error([] { clamped_knots(2, std::vector<double>{0, 0.5, 0.5, 1}); }, "break 2", "0.5");
}

}  // namespace
}  // namespace toile
