// SPDX-License-Identifier: GPL-3.0-or-later
// Changes of representation keep curves, in the plane and in space.
#include <cmath>
#include <numbers>

#include "expect_error.h"
#include "geometry/refine.h"
#include "random_geometry.h"
#include "support/near.h"

namespace toile {
namespace {

using test::Ends;
using test::expect_geometry_error;
using test::Kind;

// Insertion, elevation, clamping and extraction are convex combinations or close to it.
constexpr double rounding = 1e-13;

template <class Dim>
class CurveRepresentation : public ::testing::Test {
 public:
  static constexpr int dimension = Dim::value;
  using Curve = NurbsCurve<dimension>;

  // Degrees 1 to 6, ends and kinds of all sorts; `check(curve, random)`.
  template <class Check>
  static void for_each_curve(unsigned seed, Check&& check, int most_multiplicity = 0) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    test::Random random(seed);
    for (int degree = 1; degree <= 6; ++degree)
      for (auto ends : {Ends::clamped, Ends::unclamped})
        for (auto kind : {Kind::polynomial, Kind::rational}) {
          SCOPED_TRACE("degree " + std::to_string(degree));
          check(test::random_curve<dimension>(random, degree, 5, ends, kind, most_multiplicity), random);
        }
  }
  static void expect_same(const Curve& a, const Curve& b, double relative = rounding) {
    EXPECT_EQ(a.domain().min, b.domain().min);
    EXPECT_EQ(a.domain().max, b.domain().max);
    EXPECT_LT(test::largest_distance(a, b), relative * test::size_of(a));
  }
};
using Dims = ::testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(CurveRepresentation, Dims);

TYPED_TEST(CurveRepresentation, InsertionKeepsTheCurveAndTheOldKnots) {
  this->for_each_curve(51, [this](const auto& curve, test::Random& random) {
    const Interval d = curve.domain();
    std::vector<double> added = {random.real(d.min, d.max), random.real(d.min, d.max)};
    for (int m = 1; m < curve.degree(); ++m) added.push_back(added[0]);  // up to multiplicity p
    for (double b : curve.knots().breaks())
      if (curve.knots().multiplicity(b) < curve.degree()) added.push_back(b);  // the ends of unclamped domains too
    const auto finer = insert_knots(curve, added);
    EXPECT_EQ(finer.knots().control_point_count(),
              curve.knots().control_point_count() + static_cast<int>(added.size()));
    std::vector<double> expected(curve.knots().knots().begin(), curve.knots().knots().end());
    expected.insert(expected.end(), added.begin(), added.end());
    std::ranges::sort(expected);
    EXPECT_TRUE(std::ranges::equal(finer.knots().knots(), expected));
    this->expect_same(curve, finer);
  });
}

TYPED_TEST(CurveRepresentation, InsertionRefusesWhatHasNoPlace) {
  SCOPED_TRACE("seed 52");
  test::Random random(52);
  const auto curve = test::random_curve<TestFixture::dimension>(random, 2, 3, Ends::clamped, Kind::polynomial);
  const double outside = curve.domain().max + 1, inside = curve.domain().min + 0.01;
  expect_geometry_error([&] { insert_knots(curve, std::vector{outside}); }, "outside the domain");
  expect_geometry_error([&] { insert_knots(curve, std::vector{inside, inside, inside}); }, "2 times", "degree 2");
  expect_geometry_error([&] { insert_knots(curve, std::vector{curve.domain().max}); }, "3 times");
}

TYPED_TEST(CurveRepresentation, ClampingKeepsTheCurve) {
  this->for_each_curve(53, [this](const auto& curve, test::Random&) {
    const auto clamped = clamp(curve);
    EXPECT_TRUE(clamped.knots().clamped());
    EXPECT_EQ(clamped.knots().breaks(), curve.knots().breaks());
    this->expect_same(curve, clamped);
    EXPECT_TRUE(clamped == curve || !curve.knots().clamped());
  });
}

TYPED_TEST(CurveRepresentation, ElevationKeepsTheCurveAndItsContinuity) {
  this->for_each_curve(54, [this](const auto& curve, test::Random& random) {
    const int by = random.integer(1, 3);
    const auto higher = elevate_degree(curve, curve.degree() + by);
    EXPECT_EQ(higher.degree(), curve.degree() + by);
    EXPECT_EQ(higher.knots().breaks(), curve.knots().breaks());
    const std::vector<double> breaks = curve.knots().breaks();
    for (std::size_t i = 1; i + 1 < breaks.size(); ++i)
      EXPECT_EQ(higher.knots().multiplicity(breaks[i]), curve.knots().multiplicity(breaks[i]) + by);
    this->expect_same(curve, higher);
  });
}

TYPED_TEST(CurveRepresentation, ElevationStaysExactOnVeryUnevenSpans) {
  SCOPED_TRACE("seed 55");
  test::Random random(55);
  const KnotVector knots(3, {0, 0, 0, 0, 1e-6, 1e-3, 0.5, 0.500001, 1, 1, 1, 1});
  typename TestFixture::Curve::Points points(TestFixture::dimension, knots.control_point_count());
  for (int i = 0; i < points.cols(); ++i)
    for (int d = 0; d < TestFixture::dimension; ++d) points(d, i) = random.real(-1, 1);
  const typename TestFixture::Curve curve(knots, points);
  this->expect_same(curve, elevate_degree(curve, 7));
}

TYPED_TEST(CurveRepresentation, ElevationRefusesImpossibleDegrees) {
  const typename TestFixture::Curve line;
  expect_geometry_error([&] { elevate_degree(line, 0); }, "degree 1", "0");
  expect_geometry_error([&] { elevate_degree(line, max_degree + 1); }, "16", "15");
  EXPECT_EQ(elevate_degree(line, 1), line);
}

TYPED_TEST(CurveRepresentation, RemovalUndoesInsertion) {
  this->for_each_curve(
      56,
      [this](const auto& curve, test::Random& random) {
        const double knot = random.real(curve.domain().min + 0.05, curve.domain().max - 0.05);
        const int times = random.integer(1, curve.degree());
        auto finer = insert_knots(curve, std::vector<double>(times, knot));
        const double tolerance = 1e-11 * test::size_of(curve);
        for (int k = 0; k < times; ++k) {
          const auto back = remove_knot(finer, knot, tolerance);
          ASSERT_TRUE(back) << "removal " << k;
          finer = *back;
        }
        EXPECT_EQ(finer.knots(), curve.knots());
        EXPECT_LT((finer.points() - curve.points()).colwise().norm().maxCoeff(), tolerance);
        this->expect_same(curve, finer, 1e-11);
      },
      1);
}

TYPED_TEST(CurveRepresentation, RemovalIsRefusedWhereTheCurveWouldMove) {
  this->for_each_curve(57, [](const auto& curve, test::Random&) {
    const std::vector<double> breaks = curve.knots().breaks();
    for (std::size_t i = 1; i + 1 < breaks.size(); ++i)
      EXPECT_FALSE(remove_knot(curve, breaks[i], 1e-6)) << "a random curve isn't smoother than its knots";
  });
}

TYPED_TEST(CurveRepresentation, RemovalMovesNoPointBeyondItsTolerance) {
  this->for_each_curve(58, [](const auto& curve, test::Random&) {
    const std::vector<double> breaks = curve.knots().breaks();
    for (std::size_t i = 1; i + 1 < breaks.size(); ++i)
      for (double tolerance = 1e-4; tolerance < 1e4; tolerance *= 1.3)
        if (const auto without = remove_knot(curve, breaks[i], tolerance)) {
          EXPECT_EQ(without->knots().multiplicity(breaks[i]), curve.knots().multiplicity(breaks[i]) - 1);
          EXPECT_LE(test::largest_distance(curve, *without), tolerance);
          break;
        }
  });
}

TYPED_TEST(CurveRepresentation, RemovalTakesInteriorKnotsOnly) {
  SCOPED_TRACE("seed 59");
  test::Random random(59);
  const auto curve = test::random_curve<TestFixture::dimension>(random, 2, 3, Ends::clamped, Kind::polynomial);
  for (double knot : {curve.domain().min, curve.domain().max, curve.domain().min + 1e-3})
    expect_geometry_error([&] { remove_knot(curve, knot, 1.0); }, "no interior knot");
}

TYPED_TEST(CurveRepresentation, JoinsADiscontinuityThatIsNone) {
  SCOPED_TRACE("seed 60");
  test::Random random(60);
  const KnotVector knots(2, {0, 0, 0, 0.4, 0.4, 0.4, 1, 1, 1});
  typename TestFixture::Curve::Points points(TestFixture::dimension, 6);
  for (int i = 0; i < 6; ++i)
    for (int d = 0; d < TestFixture::dimension; ++d) points(d, i) = random.real(-1, 1);
  const typename TestFixture::Curve broken(knots, points);
  EXPECT_FALSE(remove_knot(broken, 0.4, 1e-3));
  points.col(3) = points.col(2);
  const typename TestFixture::Curve joined(knots, points);
  const auto simple = remove_knot(joined, 0.4, 0);
  ASSERT_TRUE(simple);
  EXPECT_EQ(simple->knots().multiplicity(0.4), 2);
  this->expect_same(joined, *simple);
  this->expect_same(broken, elevate_degree(broken, 4));
}

template <int Dim>
Eigen::Matrix<double, Dim, 1> de_casteljau(const BezierCurve<Dim>& piece, double t) {
  const double x = (t - piece.range.min) / piece.range.length();
  Eigen::Matrix<double, Dim + 1, Eigen::Dynamic> h(Dim + 1, piece.points.cols());
  h.template topRows<Dim>() = piece.points * piece.weights.asDiagonal();
  h.row(Dim) = piece.weights.transpose();
  for (Eigen::Index n = h.cols() - 1; n > 0; --n)
    for (Eigen::Index i = 0; i < n; ++i) h.col(i) = ((1 - x) * h.col(i) + x * h.col(i + 1)).eval();
  return h.col(0).template head<Dim>() / h(Dim, 0);
}

TYPED_TEST(CurveRepresentation, BezierPiecesReproduceTheCurve) {
  this->for_each_curve(61, [](const auto& curve, test::Random&) {
    const auto pieces = bezier_pieces(curve);
    const std::vector<double> breaks = curve.knots().breaks();
    ASSERT_EQ(pieces.size(), breaks.size() - 1);
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      EXPECT_EQ(pieces[k].range.min, breaks[k]);
      EXPECT_EQ(pieces[k].range.max, breaks[k + 1]);
      ASSERT_EQ(pieces[k].points.cols(), curve.degree() + 1);
      ASSERT_EQ(pieces[k].weights.size(), curve.degree() + 1);
      for (double t : test::spread(pieces[k].range, 20))
        EXPECT_LT((de_casteljau<TestFixture::dimension>(pieces[k], t) - curve(t)).norm(),
                  rounding * test::size_of(curve));
    }
  });
}

TYPED_TEST(CurveRepresentation, PartsAreTheCurveOverTheirRange) {
  this->for_each_curve(62, [](const auto& curve, test::Random& random) {
    const Interval d = curve.domain();
    const std::vector<double> breaks = curve.knots().breaks();
    const double a = random.real(d.min, d.max), b = random.real(d.min, d.max);
    for (Interval range : {Interval{std::min(a, b), std::max(a, b)}, Interval{d.min, a}, Interval{a, d.max},
                           Interval{breaks[1], breaks[3]}, d}) {
      const auto part = sub_curve(curve, range);
      EXPECT_TRUE(part.knots().clamped());
      EXPECT_EQ(part.domain().min, range.min);
      EXPECT_EQ(part.domain().max, range.max);
      for (double t : test::spread(range, 40)) EXPECT_LT((part(t) - curve(t)).norm(), rounding * test::size_of(curve));
      EXPECT_LT((part.points().col(0) - curve(range.min)).norm(), rounding * test::size_of(curve));
    }
    expect_geometry_error([&] { sub_curve(curve, {a, a}); }, "range");
    expect_geometry_error([&] { sub_curve(curve, {d.min - 1, a}); }, "range");
  });
}

TYPED_TEST(CurveRepresentation, ReversalRunsBackwardsOverTheSameDomain) {
  this->for_each_curve(63, [](const auto& curve, test::Random&) {
    const auto back = reversed(curve);
    const Interval d = curve.domain();
    EXPECT_EQ(back.domain().min, d.min);
    EXPECT_EQ(back.domain().max, d.max);
    EXPECT_EQ(back.knots().clamped(), curve.knots().clamped());
    for (double t : test::spread(d, 60))
      EXPECT_LT((back(d.min + (d.max - t)) - curve(t)).norm(), 1e-13 * test::size_of(curve));
  });
}

TEST(Circle, StaysRoundInEveryRepresentation) {
  const Curve2 circle = circular_arc({0, 0}, 1, 0, 2 * std::numbers::pi);
  for (const Curve2& c : {insert_knots(circle, std::vector{0.1, 0.6, 0.6}), elevate_degree(circle, 5),
                          sub_curve(circle, {0.1, 0.9}), reversed(circle)})
    for (double t : test::spread(c.domain(), 100)) expect_near_rel(c(t).norm(), 1, 1e-14);
}

}  // namespace
}  // namespace toile
