// SPDX-License-Identifier: GPL-3.0-or-later
// No number that isn't finite passes the predicates' door, whoever brings it.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "trimming/crossings.h"
#include "trimming/topology.h"
#include "trimming/winding.h"

namespace toile {
namespace {

using Eigen::Vector2d;

constexpr double bad[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                          -std::numeric_limits<double>::infinity()};

TrimmedSurface square() {
  const KnotVector knots = uniform_knots(2, 3);
  return untrimmed(rebuild(AffinePatch{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, knots, knots));
}

TEST(PredicatesDoor, RefusesPointsThatArentFinite) {
  const TrimmedSurface face = square();
  const TrimTopology topology = trace_trims(face);
  PredicateCounts counts;
  for (const double x : bad)
    for (const Vector2d& p : {Vector2d(x, 0.5), Vector2d(0.5, x), Vector2d(x, x)}) {
      EXPECT_THROW(contains(face, topology, p), GeometryError);
      EXPECT_THROW(winding_number(topology.spans.of(0), p, counts), GeometryError);
      EXPECT_THROW(orientation(p, {1, 0}, {0, 1}), GeometryError);
      EXPECT_THROW(orientation({1, 0}, p, {0, 1}), GeometryError);
      EXPECT_THROW(orientation({0, 0}, {1, 0}, p), GeometryError);
    }
  EXPECT_TRUE(contains(face, topology, {0.5, 0.5}));
}

TEST(PredicatesDoor, RefusesLinesAndParametersThatArentFinite) {
  const TrimSpan span = trim_spans(line_segment<2>({0, 0}, {1, 1})).front();
  PredicateCounts counts;
  for (const double x : bad) EXPECT_THROW(LineForm(span, Axis::u, x), GeometryError);
  EXPECT_THROW(sign_at(LineForm(span, Axis::u, 0.5), bad[0], counts), GeometryError);
  EXPECT_EQ(sign_at(LineForm(span, Axis::u, 0.5), 0.75, counts), 1);
}

TEST(PredicatesDoor, RefusesTrimsThatOverflow) {
  const double huge = std::numeric_limits<double>::max();
  // Two spans of degree 2 have to be taken apart, and the point between lies beyond the largest number.
  Eigen::Matrix2Xd points(2, 4);
  points << -huge, huge, -huge, huge, 0, 1, 2, 3;
  EXPECT_THROW(trim_spans(Curve2(uniform_knots(2, 2), points)), GeometryError);
  const TrimSpan span = trim_spans(line_segment<2>({-huge, 0}, {huge, 1})).front();
  EXPECT_THROW(LineForm(span, Axis::u, huge), GeometryError);
}

}  // namespace
}  // namespace toile
