// SPDX-License-Identifier: GPL-3.0-or-later
// Changes of representation keep surfaces.
#include "expect_error.h"
#include "geometry/refine.h"
#include "random_geometry.h"
#include "support/near.h"

namespace toile {
namespace {

using test::Ends;
using test::Kind;

constexpr double rounding = 1e-13;
constexpr Direction directions[] = {Direction::u, Direction::v};

template <class Check>
void for_each_surface(unsigned seed, Check&& check, int most_multiplicity = 0) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  test::Random random(seed);
  for (int degree = 1; degree <= 4; ++degree)
    for (auto ends : {Ends::clamped, Ends::unclamped})
      for (auto kind : {Kind::polynomial, Kind::rational}) {
        SCOPED_TRACE("degree " + std::to_string(degree));
        check(test::random_surface(random, degree, 5 - degree, 4, ends, kind, most_multiplicity), random);
      }
}

void expect_same(const NurbsSurface& a, const NurbsSurface& b, double relative = rounding) {
  for (Direction d : directions) {
    EXPECT_EQ(a.knots(d).domain().min, b.knots(d).domain().min);
    EXPECT_EQ(a.knots(d).domain().max, b.knots(d).domain().max);
  }
  EXPECT_LT(test::largest_distance(a, b), relative * test::size_of(a));
}

TEST(SurfaceRepresentation, InsertionKeepsTheSurface) {
  for_each_surface(71, [](const NurbsSurface& s, test::Random& random) {
    for (Direction d : directions) {
      const Interval domain = s.knots(d).domain();
      const std::vector<double> added = {random.real(domain.min, domain.max), random.real(domain.min, domain.max)};
      const NurbsSurface finer = insert_knots(s, d, added);
      EXPECT_EQ(finer.knots(d).control_point_count(), s.knots(d).control_point_count() + 2);
      for (double k : added) EXPECT_GE(finer.knots(d).multiplicity(k), 1);
      expect_same(s, finer);
    }
  });
}

TEST(SurfaceRepresentation, ClampingKeepsTheSurface) {
  for_each_surface(72, [](const NurbsSurface& s, test::Random&) {
    const NurbsSurface clamped = clamp(s);
    EXPECT_TRUE(clamped.u().clamped() && clamped.v().clamped());
    expect_same(s, clamped);
  });
}

TEST(SurfaceRepresentation, ElevationKeepsTheSurface) {
  for_each_surface(73, [](const NurbsSurface& s, test::Random& random) {
    for (Direction d : directions) {
      const int degree = s.knots(d).degree() + random.integer(1, 3);
      const NurbsSurface higher = elevate_degree(s, d, degree);
      EXPECT_EQ(higher.knots(d).degree(), degree);
      expect_same(s, higher);
    }
  });
}

TEST(SurfaceRepresentation, RemovalUndoesInsertionInEitherDirection) {
  for_each_surface(
      74,
      [](const NurbsSurface& s, test::Random& random) {
        for (Direction d : directions) {
          const Interval domain = s.knots(d).domain();
          const double knot = random.real(domain.min + 0.05, domain.max - 0.05);
          const NurbsSurface finer = insert_knots(s, d, std::vector{knot});
          double deviation = -1;
          const auto back = remove_knot(finer, d, knot, 1e-10, &deviation);
          ASSERT_TRUE(back);
          EXPECT_GE(deviation, 0);
          EXPECT_LE(deviation, 1e-10);
          EXPECT_EQ(back->knots(d), s.knots(d));
          EXPECT_LT((back->points() - s.points()).colwise().norm().maxCoeff(), 1e-10);
          EXPECT_FALSE(remove_knot(s, d, s.knots(d).breaks()[1], 1e-6)) << "random surfaces have real knots";
        }
      },
      1);
}

TEST(SurfaceRepresentation, RemovalBoundCoversTheWholeDomain) {
  for_each_surface(75, [](const NurbsSurface& s, test::Random&) {
    for (Direction d : directions)
      for (std::size_t i : {1u, 2u}) {
        double bound = 0;
        const auto without = remove_knot(s, d, s.knots(d).breaks()[i], 1e9, &bound);
        if (!without) continue;  // a weight would turn negative
        const double moved = test::largest_distance(s, *without);
        EXPECT_LE(moved, bound * (1 + 1e-13));  // reached where one function is 1
        EXPECT_GT(moved, 1e-6);
        EXPECT_FALSE(remove_knot(s, d, s.knots(d).breaks()[i], moved / 2));
      }
  });
}

Eigen::Vector3d bernstein_point(const BezierPatch& patch, double u, double v) {
  const auto bernstein = [](int p, double x) {
    std::vector<double> b(p + 1, 0);
    b[0] = 1;
    for (int k = 1; k <= p; ++k)
      for (int i = k; i >= 0; --i) b[i] = (1 - x) * (i < k ? b[i] : 0) + x * (i > 0 ? b[i - 1] : 0);
    return b;
  };
  const auto bu = bernstein(patch.degree_u, (u - patch.u.min) / patch.u.length());
  const auto bv = bernstein(patch.degree_v, (v - patch.v.min) / patch.v.length());
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  double w = 0;
  for (int j = 0, k = 0; j <= patch.degree_v; ++j)
    for (int i = 0; i <= patch.degree_u; ++i, ++k) {
      x += bu[i] * bv[j] * patch.weights[k] * patch.points.col(k);
      w += bu[i] * bv[j] * patch.weights[k];
    }
  return x / w;
}

TEST(SurfaceRepresentation, BezierPatchesReproduceTheSurface) {
  for_each_surface(76, [](const NurbsSurface& s, test::Random&) {
    const std::vector<BezierPatch> patches = bezier_patches(s);
    const std::vector<double> bu = s.u().breaks(), bv = s.v().breaks();
    ASSERT_EQ(patches.size(), (bu.size() - 1) * (bv.size() - 1));
    for (std::size_t k = 0; k < patches.size(); ++k) {
      const BezierPatch& patch = patches[k];
      EXPECT_EQ(patch.u.min, bu[k % (bu.size() - 1)]);  // u runs fastest
      EXPECT_EQ(patch.v.max, bv[k / (bu.size() - 1) + 1]);
      for (double u : test::spread(patch.u, 5))
        for (double v : test::spread(patch.v, 5))
          EXPECT_LT((bernstein_point(patch, u, v) - s(u, v)).norm(), rounding * test::size_of(s));
    }
  });
}

}  // namespace
}  // namespace toile
