// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "analysis/map/affine_map.h"
#include "analysis/model/kink_points.h"
#include "analysis/scheme/time_step.h"
#include "analysis/shell/kink_kernel.h"
#include "analysis/shell/shell_model.h"
#include "geometry/refine.h"
#include "support/near.h"
#include "support/panels.h"

namespace toile {
namespace {

using test::Random;

ClothPanel kinked_panel(const NurbsSurface& rest, const Fabric& fabric, double grain = 0) {
  ClothPanel panel = test::make_panel(rest, fabric, grain);
  const TrimmedSurface face = untrimmed(rest);
  panel.kinks = kink_points(face, trace_trims(face));
  return panel;
}

// The knots given made C0.
NurbsSurface with_c0_lines(NurbsSurface surface, Direction direction, const std::vector<double>& lines) {
  std::vector<double> added;
  for (const double u : lines)
    added.insert(added.end(), static_cast<std::size_t>(surface.knots(direction).degree() - 1), u);
  return insert_knots(surface, direction, added);
}

Fabric plain_fabric(double twist) {
  Fabric fabric;
  fabric.membrane = {11.7, 25.0, 4.68};
  fabric.bending = {.b0 = 0.05, .kappa0 = 3, .kappa_reg = 0.5, .twist = twist};
  return fabric;
}

// A curved panel, folded along a line in u and one in v, that only the strips hold: all else is switched off by taking
// the same panel without them away.
struct Strips {
  ShellModel with, without;
  Eigen::VectorXd q;
  double energy(const Eigen::VectorXd& at) const {
    Eigen::VectorXd ignored(at.size());
    return with.internal_force(at, ignored).total() - without.internal_force(at, ignored).total();
  }
};
Strips strips(int degree, bool rational, double grain, double twist) {
  NurbsSurface surface = test::bumpy_surface(degree, 3, 2, rational);
  surface = with_c0_lines(surface, Direction::u, {surface.u().breaks()[1]});
  surface = with_c0_lines(surface, Direction::v, {surface.v().breaks()[1]});
  Eigen::Matrix3Xd net = surface.points();
  Random random(5);
  for (double& x : net.reshaped()) x += 0.02 * random();  // kinks at rest too
  surface = surface.with_points(net);
  Strips out{ShellModel({kinked_panel(surface, plain_fabric(twist), grain)}),
             ShellModel({test::make_panel(surface, plain_fabric(twist), grain)}),
             {}};
  out.q = out.with.rest() + 0.02 * Random(7).vector(out.with.rest().size());
  return out;
}

struct Case {
  int degree;
  bool rational;
  double grain, twist;
};
class BendingStrip : public ::testing::TestWithParam<Case> {
 protected:
  Strips make() const {
    const Case& c = GetParam();
    return strips(c.degree, c.rational, c.grain, c.twist);
  }
};

TEST_P(BendingStrip, ForceIsMinusTheGradientOfTheEnergy) {
  const Strips s = make();
  ASSERT_GT(s.energy(s.q), 0);
  Eigen::VectorXd force(s.q.size()), without(s.q.size());
  s.with.internal_force(s.q, force);
  s.without.internal_force(s.q, without);
  force -= without;
  const double h = 1e-6;
  for (int k = 0; k < s.q.size(); ++k) {
    Eigen::VectorXd plus = s.q, minus = s.q;
    plus[k] += h;
    minus[k] -= h;
    const double slope = (s.energy(plus) - s.energy(minus)) / (2 * h);
    ASSERT_TRUE(test::near_rel(force[k], -slope, 1e-5, 1e-6 * force.cwiseAbs().maxCoeff())) << "dof " << k;
  }
}

TEST_P(BendingStrip, TangentIsMinusTheDerivativeOfTheForce) {
  const Strips s = make();
  const Eigen::VectorXd dq = Random(3).vector(s.q.size());
  const auto difference = [&](const auto& of) -> Eigen::VectorXd { return of(s.with) - of(s.without); };
  const Eigen::VectorXd df = difference([&](const ShellModel& m) {
    Eigen::VectorXd out(s.q.size());
    m.apply_tangent(s.q, dq, out, TangentKind::exact);
    return out;
  });
  const double h = 1e-6;
  const Eigen::VectorXd expected = difference([&](const ShellModel& m) {
    Eigen::VectorXd plus(s.q.size()), minus(s.q.size());
    m.internal_force(s.q + h * dq, plus);
    m.internal_force(s.q - h * dq, minus);
    return Eigen::VectorXd((minus - plus) / (2 * h));
  });
  EXPECT_LT((df - expected).norm(), 1e-5 * expected.norm());
}

TEST_P(BendingStrip, RigidMotionLeavesItUnbent) {
  const Strips s = make();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  const auto moved = [&](const Eigen::VectorXd& q) {
    Eigen::VectorXd out(q.size());
    for (int k = 0; k < q.size(); k += 3) out.segment<3>(k) = turn * q.segment<3>(k) + Eigen::Vector3d(3, -1, 2);
    return out;
  };
  EXPECT_LT(std::abs(s.energy(s.with.rest())), 1e-15);
  EXPECT_LT(std::abs(s.energy(moved(s.with.rest()))), 1e-12 * s.energy(s.q));
  expect_near_rel(s.energy(moved(s.q)), s.energy(s.q), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Panels, BendingStrip,
                         ::testing::Values(Case{2, false, 0, 0}, Case{2, true, 0.4, 0.03}, Case{3, false, -1.1, 0.03}));

// A strip folded along its middle by an angle: the strip of cloth between bends by theta / width.
TEST(KinkStrip, FoldCostsWhatBendingItsWidthCosts) {
  Fabric fabric = plain_fabric(0);
  const double length = 1.2, width = 0.3, theta = 0.2;
  NurbsSurface flat =
      with_c0_lines(test::flat_surface(length, width, uniform_knots(2, 4), uniform_knots(2, 2)), Direction::u, {0.5});
  const ShellModel model({kinked_panel(flat, fabric)});
  Eigen::VectorXd q = model.rest(), force(q.size());
  for (int k = 0; k < q.size(); k += 3) {
    const double beyond = std::max(0.0, q[k] - length / 2);
    q[k] += beyond * (std::cos(theta) - 1);
    q[k + 2] += beyond * std::sin(theta);
  }
  const double strip = strip_width * length / 4;
  expect_near_rel(model.internal_force(q, force).total(),
                  width * strip * bending_response(fabric.bending, theta / strip).energy, 1e-9);
}

struct Hung {
  double drop = 0, dt = 0;
};

// A strip clamped level at one end under its own weight, linear law; Newton. C0 at the spans named.
Hung hung(int degree, int spans, const std::vector<double>& c0, bool strips_on) {
  Fabric fabric;
  fabric.density = 1;
  fabric.membrane = {1e3, 1e3, 5e2};
  fabric.bending = {.b0 = 1, .kappa0 = 0, .kappa_reg = 1, .twist = 1};
  const NurbsSurface flat = with_c0_lines(
      test::flat_surface(1, 0.1, uniform_knots(degree, spans), uniform_knots(degree, 1)), Direction::u, c0);
  const ShellModel model({strips_on ? kinked_panel(flat, fabric) : test::make_panel(flat, fabric)});
  std::vector<int> free, held;
  for (int k = 0; k < model.point_count(); ++k) {
    if (k % flat.count_u() <= 1) held.push_back(k);
    for (int c = 0; c < 3 && k % flat.count_u() > 1; ++c) free.push_back(3 * k + c);
  }
  const int n = static_cast<int>(free.size());
  Eigen::VectorXd q = model.rest(), force(q.size()), dq(q.size()), column(q.size());
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(q.size());
  for (int k = 0; k < model.point_count(); ++k) weight[3 * k + 2] = -model.lumped_mass()[k];
  Eigen::MatrixXd K(n, n);
  for (int iteration = 0; iteration < 30; ++iteration) {
    for (int j = 0; j < n; ++j) {
      dq.setZero();
      dq[free[static_cast<std::size_t>(j)]] = 1;
      model.apply_tangent(q, dq, column, TangentKind::exact);
      K.col(j) = column(free);
    }
    model.internal_force(q, force);
    const Eigen::VectorXd r = (force + weight)(free);
    if (r.norm() < 1e-8 * weight(free).norm()) break;
    q(free) += K.partialPivLu().solve(r);
  }
  const AffineMap map(AffineMap::identity(model.point_count()), {}, {});
  return {-model.state(0, 1, 0.5, q).position[2],
          time_step_bound(model, map, map.reduce_scalar(model.lumped_mass()), model.rest()).dt};
}

TEST(KinkStrip, AStripWithC0LinesBendsLikeTheSmoothOne) {
  const double exact = hung(2, 24, {}, false).drop;
  for (const int spans : {6, 12, 24})
    expect_near_rel(hung(2, spans, {0.5}, true).drop, exact, spans < 24 ? 0.02 : 0.005);
  expect_near_rel(hung(3, 8, {0.5}, true).drop, exact, 0.02);
  // A line at every knot, as in a net elevated from straight pieces: softer, by the strips' part of the length at most.
  std::vector<double> all;
  for (int k = 1; k < 12; ++k) all.push_back(k / 12.0);
  const Hung everywhere = hung(2, 12, all, true);
  EXPECT_GT(everywhere.drop, exact);
  EXPECT_LT(everywhere.drop, (1 + strip_width) * exact);
  // The step bound sees the strips.
  const double without = hung(2, 12, all, false).dt;
  EXPECT_LT(everywhere.dt, 0.6 * without);
  EXPECT_GT(everywhere.dt, 0.2 * without);
}

TEST(KinkStrip, PointsLieWhereTheClothIsOnBothSides) {
  const NurbsSurface surface = with_c0_lines(test::flat_surface(1, 1, uniform_knots(2, 4), uniform_knots(2, 4)),
                                             Direction::u, {0.25, 0.5, 0.75});
  TrimmedSurface face = untrimmed(surface);
  // Left border along u = 0.25, a slanting cut that meets u = 0.5 at v = 0.5 and never reaches u = 0.75.
  const Eigen::Vector2d corners[] = {{0.25, 0}, {0.7, 0}, {0.3, 1}, {0.25, 1}};
  face.loops[0].curves.clear();
  for (int k = 0; k < 4; ++k)
    face.loops[0].curves.push_back({line_segment<2>(corners[k], corners[(k + 1) % 4]), k, false, {}});
  face.natural_bounds = false;
  double length = 0;
  for (const KinkPoint& point : kink_points(face, trace_trims(face))) {
    EXPECT_EQ(point.direction, Direction::u);
    EXPECT_EQ(point.at, 0.5);
    EXPECT_LT(point.along, 0.5);
    length += point.weight;
  }
  expect_near_rel(length, 0.5, 1e-12);
}

}  // namespace
}  // namespace toile
