// SPDX-License-Identifier: GPL-3.0-or-later
// A surface beyond its domain is the continuation of its outermost spans' functions.
#include "geometry/continuation.h"

#include <gtest/gtest.h>

#include "random_geometry.h"

namespace toile::test {
namespace {

TEST(Continuation, GoesOnAsTheOutermostSpansDo) {
  Random random(5);
  for (int p = 1; p <= 5; ++p)
    for (const Kind kind : {Kind::polynomial, Kind::rational})
      for (const Ends ends : {Ends::clamped, Ends::unclamped}) {
        SCOPED_TRACE(testing::Message() << p << ' ' << static_cast<int>(kind) << ' ' << static_cast<int>(ends));
        const NurbsSurface s = random_surface(random, p, 2, 3, ends, kind);
        for (const Direction d : {Direction::u, Direction::v}) {
          const Interval own = s.knots(d).domain(),
                         other = s.knots(d == Direction::u ? Direction::v : Direction::u).domain();
          const Interval to{own.min - 1e-3 * own.length(), own.max + 2e-3 * own.length()};
          const std::optional<NurbsSurface> c = continued(s, d, to);
          ASSERT_TRUE(c);
          EXPECT_EQ(c->knots(d).domain().min, to.min);
          EXPECT_EQ(c->knots(d).domain().max, to.max);
          EXPECT_TRUE(c->knots(d).clamped());
          for (int k = 0; k <= 20; ++k) {
            const double x = to.min + to.length() * k / 20, y = other.min + other.length() * 0.3;
            const Eigen::Vector3d a = d == Direction::u ? s(x, y) : s(y, x),
                                  b = d == Direction::u ? (*c)(x, y) : (*c)(y, x);
            EXPECT_LE((a - b).norm(), 1e-11) << k;
          }
        }
      }
}

TEST(Continuation, StaysWhereItReachesAlready) {
  Random random(6);
  const NurbsSurface s = random_surface(random, 3, 2, 3, Ends::clamped, Kind::rational);
  const Interval u = s.u().domain(), v = s.v().domain();
  EXPECT_EQ(continued(s, Direction::u, {u.min + 0.1, u.max})->u(), s.u());
  EXPECT_LE((continued(s, Direction::v, {v.min, v.max - 0.1})->points() - s.points()).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(Continuation, EndsWhereAWeightVanishes) {
  Eigen::Matrix3Xd net(3, 4);
  net << 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0;
  const NurbsSurface s(uniform_knots(1, 1), uniform_knots(1, 1), net, {1, 0.5, 1, 0.5});
  EXPECT_TRUE(continued(s, Direction::u, {0, 1.9}));
  EXPECT_FALSE(continued(s, Direction::u, {0, 2.1}));
}

}  // namespace
}  // namespace toile::test
