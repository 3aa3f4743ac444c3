// SPDX-License-Identifier: GPL-3.0-or-later
// Evaluation of curves and surfaces.
#include <cmath>
#include <limits>
#include <numbers>

#include "expect_error.h"
#include "geometry/grid_evaluation.h"
#include "geometry/trimmed_surface.h"
#include "random_geometry.h"
#include "support/near.h"

namespace toile {
namespace {

using test::Ends;
using test::expect_geometry_error;
using test::Kind;

template <class Dim>
class CurveLaw : public ::testing::Test {};
using Dims = ::testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(CurveLaw, Dims);

TYPED_TEST(CurveLaw, DerivativesMatchCentralDifferences) {
  constexpr int dim = TypeParam::value;
  SCOPED_TRACE("seed 31");
  test::Random random(31);
  for (int degree = 1; degree <= 6; ++degree)
    for (auto kind : {Kind::polynomial, Kind::rational}) {
      const auto curve = test::random_curve<dim>(random, degree, 4, Ends::unclamped, kind);
      const double h = 1e-5;
      for (int s : curve.knots().spans()) {
        const double t = random.real(curve.knots()[s] + 2 * h, curve.knots()[s + 1] - 2 * h);
        const auto at = evaluate(curve, t), low = evaluate(curve, t - h), high = evaluate(curve, t + h);
        EXPECT_LT((at.x - curve(t)).norm(), 1e-13);
        EXPECT_LT((at.d1 - (high.x - low.x) / (2 * h)).norm(), 1e-6 * (1 + at.d1.norm()));
        EXPECT_LT((at.d2 - (high.d1 - low.d1) / (2 * h)).norm(), 1e-5 * (1 + at.d1.norm() + at.d2.norm()));
      }
    }
}

TYPED_TEST(CurveLaw, EqualWeightsAreNoWeights) {
  constexpr int dim = TypeParam::value;
  SCOPED_TRACE("seed 32");
  test::Random random(32);
  const auto plain = test::random_curve<dim>(random, 3, 4, Ends::clamped, Kind::polynomial);
  const NurbsCurve<dim> equal(plain.knots(), plain.points(), std::vector<double>(plain.points().cols(), 0.7));
  EXPECT_FALSE(equal.rational());
  for (double t : test::spread(plain.domain(), 20)) EXPECT_EQ(plain(t), equal(t));
}

TYPED_TEST(CurveLaw, AProjectiveScaleOfAllWeightsChangesNothing) {
  constexpr int dim = TypeParam::value;
  SCOPED_TRACE("seed 33");
  test::Random random(33);
  const auto curve = test::random_curve<dim>(random, 3, 4, Ends::clamped, Kind::rational);
  std::vector<double> weights = curve.weights();
  for (double& w : weights) w *= 7.3;
  const NurbsCurve<dim> scaled(curve.knots(), curve.points(), weights);
  for (double t : test::spread(curve.domain(), 40)) {
    const auto a = evaluate(curve, t), b = evaluate(scaled, t);
    EXPECT_LT((a.x - b.x).norm(), 1e-13);
    EXPECT_LT((a.d2 - b.d2).norm(), 1e-11 * (1 + a.d2.norm()));
  }
}

TYPED_TEST(CurveLaw, ConstructorNamesTheOffendingNumber) {
  constexpr int dim = TypeParam::value;
  using Points = typename NurbsCurve<dim>::Points;
  const KnotVector knots(2, {0, 0, 0, 0.5, 1, 1, 1});
  Points points = Points::Zero(dim, 4);
  expect_geometry_error([&] { NurbsCurve<dim>(knots, Points::Zero(dim, 5)); }, "4 control points", "5");
  expect_geometry_error([&] { NurbsCurve<dim>(knots, points, {1, 1, 1}); }, "4 weights", "3");
  expect_geometry_error([&] { NurbsCurve<dim>(knots, points, {1, 1, -0.5, 1}); }, "weight 2", "-0.5");
  expect_geometry_error([&] { NurbsCurve<dim>(knots, points, {1, 0, 1, 1}); }, "weight 1", "0");
  points(dim - 1, 3) = std::numeric_limits<double>::infinity();
  expect_geometry_error([&] { NurbsCurve<dim>(knots, points); }, "control point 3", "finite");
}

TEST(Curve, ArcIsACircle) {
  constexpr double pi = std::numbers::pi;
  for (const auto& [a, b] : {std::pair{0.0, 2 * pi}, {0.3, 0.5}, {-1.0, 0.5}, {1.0, 1.0 + pi}, {2.0, 6.0}}) {
    const Curve2 arc = circular_arc({3, -2}, 2.5, a, b);
    for (double t : test::spread(arc.domain(), 101)) {
      const CurveJet<2> jet = evaluate(arc, t);
      const Eigen::Vector2d r = jet.x - Eigen::Vector2d(3, -2);
      expect_near_rel(r.norm(), 2.5, 1e-15 * 4);
      // Counter-clockwise, curvature 1 / radius.
      const double turn = jet.d1.x() * jet.d2.y() - jet.d1.y() * jet.d2.x();
      expect_near_rel(turn / std::pow(jet.d1.norm(), 3), 1 / 2.5, 1e-12);
    }
    EXPECT_LT((arc.start() - Eigen::Vector2d(3 + 2.5 * std::cos(a), -2 + 2.5 * std::sin(a))).norm(), 1e-14);
    EXPECT_LT((arc.end() - Eigen::Vector2d(3 + 2.5 * std::cos(b), -2 + 2.5 * std::sin(b))).norm(), 1e-14);
  }
  const Curve2 circle = circular_arc({1, 1}, 1, 0.1, 0.1 + 2 * pi);
  EXPECT_EQ(circle.start(), circle.end());
  expect_geometry_error([] { circular_arc({0, 0}, -1, 0, 1); }, "radius", "-1");
  expect_geometry_error([] { circular_arc({0, 0}, 1, 1, 1); }, "0", "2 pi");
  expect_geometry_error([] { circular_arc({0, 0}, 1, 0, 7); }, "7", "2 pi");
}

TEST(Curve, LengthsMatchClosedForms) {
  constexpr double pi = std::numbers::pi;
  const Curve2 circle = circular_arc({5, 5}, 2, 0, 2 * pi);
  expect_near_rel(arc_length(circle, circle.domain()), 4 * pi, 1e-12);
  expect_near_rel(arc_length(circle, {0.25, 0.75}), 2 * pi, 1e-12);
  const Curve3 line = line_segment<3>({1, 2, 3}, {2, 4, 5});
  expect_near_rel(arc_length(line, {0.5, 1}), 1.5, 1e-15);
  // y = x^2 over [0, 1].
  const Curve2 parabola(KnotVector(2, {0, 0, 0, 1, 1, 1}), (Curve2::Points(2, 3) << 0, 0.5, 1, 0, 0, 1).finished());
  expect_near_rel(arc_length(parabola, {0, 1}), std::sqrt(5.0) / 2 + std::asinh(2.0) / 4, 1e-12);
  // The cusp of x = t^3, y = t^2 over [-1, 1] (speed |t| sqrt(9 t^2 + 4)).
  const Curve2 cusp(KnotVector(3, {-1, -1, -1, -1, 1, 1, 1, 1}),
                    (Curve2::Points(2, 4) << -1, 1, -1, 1, 1, -1. / 3, -1. / 3, 1).finished());
  expect_near_rel(arc_length(cusp, {-1, 1}), 2 * (std::pow(13.0, 1.5) - 8) / 27, 1e-9);
}

TEST(Surface, DerivativesMatchCentralDifferences) {
  SCOPED_TRACE("seed 34");
  test::Random random(34);
  const double h = 1e-5;
  for (int degree = 1; degree <= 4; ++degree)
    for (auto kind : {Kind::polynomial, Kind::rational}) {
      const NurbsSurface s = test::random_surface(random, degree, 5 - degree, 3, Ends::unclamped, kind);
      for (int su : s.u().spans())
        for (int sv : s.v().spans()) {
          const double u = random.real(s.u()[su] + 2 * h, s.u()[su + 1] - 2 * h);
          const double v = random.real(s.v()[sv] + 2 * h, s.v()[sv + 1] - 2 * h);
          const SurfaceJet at = evaluate(s, u, v);
          const SurfaceJet u0 = evaluate(s, u - h, v), u1 = evaluate(s, u + h, v);
          const SurfaceJet v0 = evaluate(s, u, v - h), v1 = evaluate(s, u, v + h);
          const double size = 1 + at.u.norm() + at.v.norm() + at.uu.norm() + at.uv.norm() + at.vv.norm();
          EXPECT_LT((at.x - s(u, v)).norm(), 1e-13);
          EXPECT_LT((at.u - (u1.x - u0.x) / (2 * h)).norm(), 1e-6 * size);
          EXPECT_LT((at.v - (v1.x - v0.x) / (2 * h)).norm(), 1e-6 * size);
          EXPECT_LT((at.uu - (u1.u - u0.u) / (2 * h)).norm(), 1e-5 * size);
          EXPECT_LT((at.uv - (v1.u - v0.u) / (2 * h)).norm(), 1e-5 * size);
          EXPECT_LT((at.vv - (v1.v - v0.v) / (2 * h)).norm(), 1e-5 * size);
        }
    }
}

TEST(Surface, FunctionsSumToOneAndGiveTheSurface) {
  SCOPED_TRACE("seed 35");
  test::Random random(35);
  for (auto kind : {Kind::polynomial, Kind::rational})
    for (int degree : {1, 2, 3, 7}) {
      const NurbsSurface s = test::random_surface(random, degree, 2, 3, Ends::unclamped, kind);
      for (int trial = 0; trial < 50; ++trial) {
        const double u = random.real(s.u().domain().min, s.u().domain().max);
        const double v = random.real(s.v().domain().min, s.v().domain().max);
        SurfaceBasis basis;
        evaluate_basis(s, u, v, basis);
        const SurfaceJet jet = evaluate(s, u, v);
        const Eigen::Vector3d expected[] = {jet.x, jet.u, jet.v, jet.uu, jet.uv, jet.vv};
        for (int row = 0; row < 6; ++row) {
          Eigen::Vector3d sum = Eigen::Vector3d::Zero();
          double total = 0, size = 0;
          for (int b = 0, k = 0; b < basis.count_v; ++b)
            for (int a = 0; a < basis.count_u; ++a, ++k) {
              sum += basis.value[row][k] * s.points().col(s.index(basis.first_u + a, basis.first_v + b));
              total += basis.value[row][k];
              size += std::abs(basis.value[row][k]);
            }
          EXPECT_LT((sum - expected[row]).norm(), 1e-12 * (1 + size) * test::size_of(s));
          expect_near_rel(total, row == 0 ? 1 : 0, 1e-13, 1e-12 * size);
        }
      }
    }
}

TEST(Surface, FunctionsAboveTheirHighestDegreeAreRefused) {
  SCOPED_TRACE("seed 36");
  test::Random random(36);
  const NurbsSurface s = test::random_surface(random, 8, 2, 2, Ends::clamped, Kind::polynomial);
  SurfaceBasis basis;
  expect_geometry_error([&] { evaluate_basis(s, 0, 0, basis); }, "8 x 2", "7");
  const SurfaceJet jet = evaluate(s, s.u().domain().min, s.v().domain().min);
  EXPECT_LT((jet.x - s.points().col(0)).norm(), 1e-14);
}

TEST(Surface, GridsAndGroupsAgreeWithSinglePoints) {
  SCOPED_TRACE("seed 37");
  test::Random random(37);
  for (auto kind : {Kind::polynomial, Kind::rational})
    for (const auto& [pu, pv] : {std::pair{2, 2}, {3, 3}, {1, 4}, {0, 2}, {9, 3}}) {
      const NurbsSurface s = test::random_surface(random, pu, pv, 4, Ends::unclamped, kind);
      const std::vector<double> u = test::spread(s.u().domain(), 13, s.u().breaks());
      const std::vector<double> v = test::spread(s.v().domain(), 7, s.v().breaks());
      std::vector<SurfaceJet> jets(u.size() * v.size());
      evaluate_grid(s, tabulate_basis(s.u(), u), tabulate_basis(s.v(), v), jets);
      const auto agree = [&](const SurfaceJet& a, const SurfaceJet& b) {
        EXPECT_LT((a.x - b.x).norm(), 1e-12);
        EXPECT_LT((a.u - b.u).norm() + (a.v - b.v).norm(), 1e-12 * (10 + b.u.norm() + b.v.norm()));
        EXPECT_LT((a.uu - b.uu).norm() + (a.uv - b.uv).norm() + (a.vv - b.vv).norm(),
                  1e-11 * (10 + b.uu.norm() + b.uv.norm() + b.vv.norm()));
      };
      for (std::size_t j = 0; j < v.size(); ++j)
        for (std::size_t i = 0; i < u.size(); ++i) agree(jets[i + u.size() * j], evaluate(s, u[i], v[j]));

      const int su = s.u().spans()[1], sv = s.v().spans()[2];
      std::vector<Eigen::Vector2d> points(9);
      for (auto& p : points) p << random.real(s.u()[su], s.u()[su + 1]), random.real(s.v()[sv], s.v()[sv + 1]);
      std::vector<SurfaceJet> group(points.size());
      evaluate_on_span(s, su, sv, points, group);
      for (std::size_t k = 0; k < points.size(); ++k) agree(group[k], evaluate(s, points[k].x(), points[k].y()));
    }
}

TEST(Surface, ConstructorNamesTheOffendingNumber) {
  const KnotVector u(2, {0, 0, 0, 1, 1, 1}), v;
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 6);
  expect_geometry_error([&] { NurbsSurface(u, v, Eigen::Matrix3Xd::Zero(3, 5)); }, "3 x 2", "5");
  expect_geometry_error([&] { NurbsSurface(u, v, points, std::vector<double>(4, 1.0)); }, "3 x 2 weights", "4");
  expect_geometry_error([&] { NurbsSurface(u, v, points, {1, 1, 1, 1, -2, 1}); }, "weight 4", "(1, 1)", "-2");
  points(0, 2) = std::numeric_limits<double>::quiet_NaN();
  expect_geometry_error([&] { NurbsSurface(u, v, points); }, "control point 2", "(2, 0)");
}

TEST(Surface, AnotherNetKeepsKnotsAndWeights) {
  const NurbsSurface octant = test::sphere_octant();
  const NurbsSurface moved = octant.with_points(octant.points() * 2);
  EXPECT_EQ(moved.weights(), octant.weights());
  EXPECT_EQ(moved.u(), octant.u());
  expect_near_rel(moved(0.3, 0.4).norm(), 2, 1e-14);
  EXPECT_FALSE(moved == octant);
  EXPECT_TRUE(octant.with_points(octant.points()) == octant);
}

TEST(TrimmedSurface, NaturalLoopRunsCounterClockwiseFromTheLowestV) {
  SCOPED_TRACE("seed 38");
  test::Random random(38);
  const NurbsSurface s = test::random_surface(random, 2, 3, 3, Ends::unclamped, Kind::polynomial);
  const TrimLoop loop = natural_loop(s);
  ASSERT_EQ(loop.curves.size(), 4u);
  EXPECT_EQ(loop.kind, LoopKind::outer);
  double twice_area = 0;
  for (int k = 0; k < 4; ++k) {
    const Curve2& curve = loop.curves[k].curve;
    EXPECT_EQ(loop.curves[k].index, k);
    EXPECT_EQ(curve.end(), loop.curves[(k + 1) % 4].curve.start());
    twice_area += curve.start().x() * curve.end().y() - curve.start().y() * curve.end().x();
  }
  expect_near_rel(twice_area / 2, s.u().domain().length() * s.v().domain().length(), 1e-13);
  EXPECT_EQ(loop.curves[0].curve.start(), Eigen::Vector2d(s.u().domain().min, s.v().domain().min));
  EXPECT_EQ(loop.curves[0].curve.end(), Eigen::Vector2d(s.u().domain().max, s.v().domain().min));
}

}  // namespace
}  // namespace toile
