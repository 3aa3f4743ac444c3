// SPDX-License-Identifier: GPL-3.0-or-later
// refine(): resolution for the analysis.
#include <numeric>

#include "expect_error.h"
#include "geometry/measure.h"
#include "geometry/refine.h"
#include "random_geometry.h"
#include "support/near.h"

namespace toile {
namespace {

using test::Ends;
using test::expect_geometry_error;
using test::Kind;

constexpr Direction directions[] = {Direction::u, Direction::v};

// The map (u, v) -> (3 + 2u + v, 1 - u + v/2, u + v) on the given knots.
const AffinePatch plane{{3, 1, 0}, {2, -1, 1}, {1, 0.5, 1}};

void expect_plane(const NurbsSurface& s, double tolerance = 1e-14) {
  for (double u : test::spread(s.u().domain(), 17))
    for (double v : test::spread(s.v().domain(), 17))
      EXPECT_LT((s(u, v) - (plane.origin + u * plane.du + v * plane.dv)).norm(), tolerance * 10);
}

void expect_contains(const KnotVector& finer, const KnotVector& own) {
  const std::vector<double> all = finer.breaks();
  for (double b : own.breaks()) EXPECT_TRUE(std::ranges::binary_search(all, b)) << b;
}

void expect_simple(const KnotVector& knots) {
  EXPECT_TRUE(knots.clamped());
  const std::vector<double> breaks = knots.breaks();
  for (std::size_t i = 1; i + 1 < breaks.size(); ++i) EXPECT_EQ(knots.multiplicity(breaks[i]), 1);
}

TEST(AffinePatch, IsRecognisedWithinTheTolerance) {
  SCOPED_TRACE("seed 101");
  test::Random random(101);
  for (auto ends : {Ends::clamped, Ends::unclamped})
    for (int degree : {1, 2, 3, 5}) {
      const KnotVector u = test::random_knots(random, degree, 4, ends), v = test::random_knots(random, 2, 3, ends);
      const NurbsSurface flat = rebuild(plane, u, v);
      expect_plane(flat);
      const auto patch = affine_patch(flat, 1e-12);
      ASSERT_TRUE(patch);
      EXPECT_LT((patch->du - plane.du).norm() + (patch->dv - plane.dv).norm(), 1e-12);
      EXPECT_LT((patch->origin - plane.origin).norm(), 1e-12);
      Eigen::Matrix3Xd points = flat.points();
      for (Eigen::Index k = 0; k < points.cols(); ++k)
        for (int d = 0; d < 3; ++d) points(d, k) += random.real(-1e-6, 1e-6);
      const NurbsSurface rough = flat.with_points(points);
      EXPECT_FALSE(affine_patch(rough, 1e-8));
      const auto fit = affine_patch(rough, 1e-5);
      ASSERT_TRUE(fit);
      for (double a : test::spread(u.domain(), 15))
        for (double b : test::spread(v.domain(), 15))
          EXPECT_LE((rough(a, b) - (fit->origin + a * fit->du + b * fit->dv)).norm(), fit->deviation);
    }
}

TEST(AffinePatch, SeesThroughWeightsThatDoNotBendTheMap) {
  // A rational quadratic whose map is affine: (a + b u) w(u) / w(u) with w linear, so homogeneous degree 2.
  const double w0 = 1, w1 = 3;
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 6);
  std::vector<double> weights;
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 3; ++i) {
      const double w = i == 0 ? w0 : i == 2 ? w1 : (w0 + w1) / 2;
      const double x = i == 0 ? 0 : i == 2 ? w1 : w0 / 2;  // Bernstein coefficients of u w(u), u in [0, 1]
      points.col(i + 3 * j) << x / w, j, 0;
      weights.push_back(w);
    }
  const NurbsSurface s(KnotVector(2, {0, 0, 0, 1, 1, 1}), KnotVector(), points, weights);
  ASSERT_LT((s(0.3, 0.6) - Eigen::Vector3d(0.3, 0.6, 0)).norm(), 1e-15);
  const auto patch = affine_patch(s, 1e-13);
  ASSERT_TRUE(patch);
  EXPECT_LT((patch->du - Eigen::Vector3d(1, 0, 0)).norm(), 1e-14);
  weights[1] *= 1.01;
  EXPECT_FALSE(affine_patch(NurbsSurface(s.u(), s.v(), points, weights), 1e-4));
}

TEST(AffinePatch, IsNoneWhereTheParametersBend) {
  // Flat, but not affine: a square with one corner pulled, and an uneven quadratic.
  Eigen::Matrix3Xd corners(3, 4);
  corners << 0, 1, 0, 1.5, 0, 0, 1, 1.5, 0, 0, 0, 0;
  EXPECT_FALSE(affine_patch({KnotVector(), KnotVector(), corners}, 0.1));
  EXPECT_FALSE(affine_patch(test::cylinder(1, 1), 0.1));
}

TEST(Refine, RefusesMoreControlPointsThanMemoryHolds) {
  const NurbsSurface bilinear = rebuild(plane, KnotVector(1, {0, 0, 2, 2}), KnotVector(1, {-1, -1, 1, 1}));
  for (const NurbsSurface& surface : {bilinear, test::cylinder(1, 1)}) {
    EXPECT_THROW(refine(surface, {.spans = {{10000, 10000}}}), GeometryError);
    EXPECT_THROW(refine(surface, {.span = 1e-5}), GeometryError);
  }
}

TEST(Refine, GivesAFlatPanelExactlyWhatWasAsked) {
  const NurbsSurface bilinear = rebuild(plane, KnotVector(1, {0, 0, 2, 2}), KnotVector(1, {-1, -1, 1, 1}));
  const Refinement points = refine(bilinear, {.degree = 2, .control_points = {{10, 12}}});
  EXPECT_TRUE(points.rebuilt_flat);
  EXPECT_EQ(points.surface.count_u(), 10);
  EXPECT_EQ(points.surface.count_v(), 12);
  EXPECT_EQ(points.surface.u(), uniform_knots(2, 8, {0, 2}));
  EXPECT_TRUE(points.kinks.empty());
  EXPECT_LT(points.deviation, 1e-14);
  expect_plane(points.surface);

  const Refinement spans = refine(bilinear, {.degree = 3, .spans = {{5, 7}}});
  EXPECT_EQ(spans.surface.u(), uniform_knots(3, 5, {0, 2}));
  EXPECT_EQ(spans.surface.v(), uniform_knots(3, 7, {-1, 1}));
  expect_plane(spans.surface);

  EXPECT_EQ(refine(bilinear, {.degree = 1, .spans = {{2, 2}}}).surface.u().degree(), 1);
  EXPECT_EQ(refine(bilinear, {}).surface.u().degree(), 2) << "a shell needs degree 2";
}

TEST(Refine, LowersTheDegreeOfABicubicFlatPanel) {
  SCOPED_TRACE("seed 102");
  test::Random random(102);
  const NurbsSurface bicubic = rebuild(plane, test::random_knots(random, 3, 4, Ends::clamped),
                                       test::random_knots(random, 3, 2, Ends::unclamped));
  const Refinement quadratic = refine(bicubic, {.degree = 2});
  for (Direction d : directions) {
    EXPECT_EQ(quadratic.surface.knots(d).degree(), 2);
    EXPECT_EQ(quadratic.surface.knots(d).breaks(), bicubic.knots(d).breaks());
    expect_simple(quadratic.surface.knots(d));
  }
  expect_plane(quadratic.surface, 1e-13);
  EXPECT_EQ(refine(bicubic, {}).surface.u().degree(), 3);
}

TEST(Refine, DissolvesTheKinksOfAnElevatedFlatNet) {
  const NurbsSurface grid = rebuild(plane, KnotVector(1, {0, 0, 0.3, 0.7, 1, 1}), KnotVector(1, {0, 0, 0.5, 1, 1}));
  const NurbsSurface elevated = elevate_degree(elevate_degree(grid, Direction::u, 2), Direction::v, 2);
  ASSERT_EQ(elevated.u().multiplicity(0.3), 2);
  const Refinement smooth = refine(elevated, {});
  EXPECT_TRUE(smooth.kinks.empty());
  EXPECT_EQ(smooth.surface.u(), clamped_knots(2, std::vector{0.0, 0.3, 0.7, 1.0}));
  expect_plane(smooth.surface);
}

TEST(Refine, SplitsTheSpansOfAFlatPanelAndKeepsItsKnots) {
  const NurbsSurface grid = rebuild(plane, KnotVector(2, {0, 0, 0, 0.3, 1, 1, 1}), KnotVector(2, {0, 0, 0, 1, 1, 1}));
  const Refinement finer = refine(grid, {.spans = {{10, 4}}});
  EXPECT_EQ(finer.surface.u().spans().size(), 10u);
  expect_contains(finer.surface.u(), grid.u());
  expect_plane(finer.surface);
  // Fewer spans than the panel has: the map is affine, so equal spans serve.
  EXPECT_EQ(refine(grid, {.spans = {{1, 1}}}).surface.u(), uniform_knots(2, 1));
  expect_geometry_error([&] { refine(grid, {.spans = {{0, 3}}}); }, "direction u", "0 spans", "at least 1");
  expect_geometry_error(
      [&] {
        refine(grid, {.degree = 3, .control_points = {{9, 3}}});
      },
      "direction v", "3 control points", "at least 4");
}

TEST(Refine, KeepsAFileThatHasTheKnotsAskedFor) {
  SCOPED_TRACE("seed 103");
  test::Random random(103);
  NurbsSurface own = rebuild(plane, uniform_knots(2, 4), uniform_knots(2, 3));
  Eigen::Matrix3Xd points = own.points();
  for (Eigen::Index k = 0; k < points.cols(); ++k) points(0, k) += random.real(-1e-7, 1e-7);
  own = own.with_points(points);
  const Refinement kept = refine(own, {.spans = {{4, 3}}, .tolerance = 1e-5});
  EXPECT_EQ(kept.surface, own);
  EXPECT_EQ(kept.deviation, 0);
}

TEST(Refine, SpanSplitsEachSpanByItsLongestIsoCurve) {
  // du is sqrt(6) long, dv 1.5.
  const NurbsSurface grid = rebuild(plane, KnotVector(1, {0, 0, 1, 4, 4}), KnotVector(1, {0, 0, 2, 2}));
  const Refinement finer = refine(grid, {.span = 1.0});
  const auto length = [](double parameters, double speed) { return static_cast<int>(std::ceil(parameters * speed)); };
  EXPECT_EQ(finer.surface.u().spans().size(), length(1, std::sqrt(6)) + length(3, std::sqrt(6)));
  EXPECT_EQ(finer.surface.v().spans().size(), 3u) << "3 / 1 is three, not four";
  expect_contains(finer.surface.u(), grid.u());

  // 0.1 * 3 is a little more than 0.3 in doubles; that doesn't make a fourth part.
  const NurbsSurface tenth = rebuild({{0, 0, 0}, {0.1, 0, 0}, {0, 1, 0}}, KnotVector(1, {0, 0, 3, 3}), KnotVector());
  EXPECT_EQ(refine(tenth, {.span = 0.1}).surface.u().spans().size(), 3u);

  // A cone strip: the longer rim counts.
  NurbsSurface cone = test::cylinder(1, 2);
  Eigen::Matrix3Xd points = cone.points();
  points.topRightCorner(2, cone.count_u()) *= 3;
  cone = cone.with_points(points);
  const double quarter = 3 * std::acos(-1.0) / 2;
  for (double h : {quarter * 0.999 / 4, quarter * 1.001 / 4}) {
    const Refinement strip = refine(cone, {.span = h});
    EXPECT_EQ(strip.surface.u().spans().size(), h < quarter / 4 ? 20u : 16u);
    EXPECT_LT(test::largest_distance(cone, strip.surface), 1e-13 * test::size_of(cone));
  }
}

TEST(Refine, GivesCurvedSurfacesTheTotalsAskedFor) {
  SCOPED_TRACE("seed 104");
  test::Random random(104);
  for (auto kind : {Kind::polynomial, Kind::rational})
    for (auto ends : {Ends::clamped, Ends::unclamped}) {
      const NurbsSurface s = test::random_surface(random, 2, 3, 4, ends, kind, 1);
      const Refinement spans = refine(s, {.spans = {{11, 4}}});
      EXPECT_FALSE(spans.rebuilt_flat);
      EXPECT_EQ(spans.surface.u().spans().size(), 11u);
      EXPECT_EQ(spans.surface.v().spans().size(), 4u);
      const Refinement points = refine(s, {.degree = 3, .control_points = {{23, 19}}});
      EXPECT_EQ(points.surface.count_u(), 23);
      EXPECT_EQ(points.surface.count_v(), 19);
      EXPECT_EQ(points.surface.u().degree(), 3);
      for (const Refinement* r : {&spans, &points}) {
        EXPECT_LT(test::largest_distance(s, r->surface), 1e-12 * test::size_of(s));
        EXPECT_TRUE(r->kinks.empty());
        for (Direction d : directions) expect_contains(r->surface.knots(d), s.knots(d));
      }
      expect_geometry_error([&] { refine(s, {.spans = {{3, 9}}}); }, "direction u", "3 spans", "at least 4");
      expect_geometry_error(
          [&] {
            refine(s, {.control_points = {{9, 6}}});
          },
          "direction v", "6 control points", "at least 7");
    }
}

TEST(Refine, SharesATotalByLength) {
  // A bent strip whose spans are 3 and 1 long along u (nearly: the bend is slight).
  const KnotVector u(2, {0, 0, 0, 0.75, 1, 1, 1}), v(1, {0, 0, 1, 1});
  Eigen::Matrix3Xd points(3, 8);
  for (int i = 0; i < 4; ++i) {
    points.col(i) << 4 * u.greville(i), 0, i == 1 ? 0.01 : 0;
    points.col(i + 4) << 4 * u.greville(i), 1, i == 1 ? 0.01 : 0;
  }
  const Refinement shared = refine({u, v, points}, {.degree = 2, .spans = {{8, 1}}});
  std::vector<double> expected;
  for (int k = 0; k <= 8; ++k) expected.push_back(k / 8.0);
  const std::vector<double> breaks = shared.surface.u().breaks();
  ASSERT_EQ(breaks.size(), expected.size());
  for (std::size_t k = 0; k < breaks.size(); ++k) expect_near_rel(breaks[k], expected[k], 1e-15);
}

TEST(Refine, RaisesDegreesOfCurvedSurfacesOnlyUpwards) {
  SCOPED_TRACE("seed 105");
  test::Random random(105);
  const NurbsSurface s = test::random_surface(random, 1, 3, 2, Ends::clamped, Kind::polynomial, 1);
  const Refinement two = refine(s, {.degree = 2}), one = refine(s, {.degree = 1}), own = refine(s, {});
  EXPECT_EQ(two.surface.u().degree(), 2);
  EXPECT_EQ(two.surface.v().degree(), 3);
  EXPECT_EQ(one.surface.u().degree(), 2);
  EXPECT_EQ(own.surface.u().degree(), 1);
  EXPECT_EQ(own.surface, s);
  expect_geometry_error([&] { refine(s, {.degree = 16}); }, "degree 16");
  expect_geometry_error([&] { refine(s, {.span = -1.0}); }, "span -1");
  expect_geometry_error([&] { refine(s, {.span = 1e-9}); }, "more than");
  expect_geometry_error([&] { refine(s, {.span = 1.0, .spans = {{3, 3}}}); }, "one of");
}

TEST(Refine, RemovesKinksThatTheGeometryDoesNotHave) {
  SCOPED_TRACE("seed 106");
  test::Random random(106);
  for (auto kind : {Kind::polynomial, Kind::rational})
    for (int degree : {2, 3}) {
      const NurbsSurface smooth = test::random_surface(random, degree, degree, 3, Ends::clamped, kind, 1);
      const double a = smooth.u().breaks()[1], b = smooth.v().breaks()[2];
      NurbsSurface chain = insert_knots(smooth, Direction::u, std::vector<double>(degree - 1, a));
      chain = insert_knots(chain, Direction::v, std::vector<double>(degree - 1, b));
      ASSERT_EQ(chain.u().multiplicity(a), degree);
      const Refinement back = refine(chain, {.tolerance = 1e-11});
      EXPECT_TRUE(back.kinks.empty());
      EXPECT_EQ(back.surface.u(), smooth.u());
      EXPECT_EQ(back.surface.v(), smooth.v());
      EXPECT_LE(back.deviation, 1e-11);
      EXPECT_LT(test::largest_distance(chain, back.surface), 1e-11);
      // Rounding alone is allowed without any tolerance.
      EXPECT_TRUE(refine(chain, {}).kinks.empty());
    }
}

TEST(Refine, ListsTheKinksThatStay) {
  const KnotVector u(1, {0, 0, 0.5, 1, 1}), v(1, {0, 0, 0.25, 1, 1});
  Eigen::Matrix3Xd points(3, 9);
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) points.col(i + 3 * j) << i, 4 * v[j + 1], i == 1;  // a roof, folded along u = 0.5
  const NurbsSurface roof(u, v, points);
  const Refinement folded = refine(roof, {.degree = 2});
  ASSERT_EQ(folded.kinks.size(), 1u);
  EXPECT_EQ(folded.kinks[0], std::pair(Direction::u, 0.5));
  EXPECT_EQ(folded.surface.u().multiplicity(0.5), 2);
  EXPECT_EQ(folded.surface.v().multiplicity(0.25), 1) << "along the ridge the roof is straight";
  EXPECT_LT(test::largest_distance(roof, folded.surface), 1e-14);
}

}  // namespace
}  // namespace toile
