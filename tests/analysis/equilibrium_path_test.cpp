// SPDX-License-Identifier: GPL-3.0-or-later
// Large deflections of shells against Sze, Liu & Lo 2004 (Abaqus S4R); numbers of their tables. A hinged roof that
// snaps.
#include "analysis/scheme/equilibrium_path.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "analysis/constraint/composed_rows.h"
#include "analysis/linear/indefinite_factor.h"
#include "analysis/projection/row_matrix.h"
#include "analysis/scheme/node_forces.h"
#include "geometry/error.h"
#include "support/near.h"
#include "support/obstacle_course.h"

namespace toile {
namespace {

using test::cylinder_part;
using test::flat_surface;
using test::one_degree;
using test::refined;
using test::right_angle;
using test::shell;
using test::ShellProblem;
using test::sphere_part;

// A dead line load [N/m] on the edge u = max, whose control points lie evenly by their functions' integrals.
void pull_edge(ShellProblem& problem, double length, const Eigen::Vector3d& force) {
  const KnotVector& v = problem.rest().v();
  for (int k = 0; k < problem.along(0); ++k)
    problem.pull(problem.edge(0, 1, k), (v[k + v.degree() + 1] - v[k]) / (v.degree() + 1) * length * force);
}

// To the whole load; calls `each` after every step.
PathPoint follow(ShellProblem& problem, const PathOptions& options, const std::function<void(const PathPoint&)>& each) {
  problem.finish();
  EquilibriumPath path(problem.system(), options);
  PathPoint point;
  StepWork work;
  while (point.factor < 1) {
    const PathReport report = path.step(problem.state, 1, point, work);
    EXPECT_EQ(report.trouble, "");
    if (!report.trouble.empty()) break;
    each(point);
  }
  return point;
}

bool at(const PathPoint& point, double wanted) {
  return std::abs(point.factor - wanted) < 1e-9;
}

ShellProblem cantilever(int spans = 12) {
  ShellProblem problem(flat_surface(10, 1, uniform_knots(3, spans), uniform_knots(3, 1)), shell(1.2e6, 0, 0.1));
  problem.hold_edge(0, 0, {1, 1, 1}, 2);
  pull_edge(problem, 1, {0, 0, 4});
  return problem;
}

TEST(EquilibriumPath, CantileverUnderEndShear) {
  ShellProblem problem = cantilever();
  int seen = 0;
  const PathPoint end = follow(problem, {.load_steps = 20}, [&](const PathPoint& point) {
    const Eigen::Vector3d moved = problem.moved(1, 0.5);
    for (const auto& [f, u, w] : {std::tuple(0.05, 0.026, 0.663),
                                  {0.25, 0.563, 3.015},
                                  {0.5, 1.604, 4.933},
                                  {0.75, 2.541, 6.031},
                                  {1.0, 3.286, 6.698}}) {
      if (!at(point, f)) continue;
      ++seen;
      EXPECT_NEAR(-moved.x(), u, 3e-3 * 3.286) << f;
      EXPECT_NEAR(moved.z(), w, 2e-3 * 6.698) << f;
    }
  });
  EXPECT_EQ(seen, 5);
  EXPECT_EQ(end.steps, 20);
  EXPECT_EQ(end.negative, 0);
}

// The annulus as a spline through its points: its border is round to 1e-6.
NurbsSurface annulus(double inner, double outer, int spans) {
  const KnotVector u = uniform_knots(3, spans), v = uniform_knots(3, spans / 8);
  const int n = u.control_point_count();
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(n, n), circle(n, 2);
  for (int i = 0; i < n; ++i) {
    const BasisValues at = evaluate_basis(u, u.greville(i), 0);
    for (int a = 0; a <= at.degree; ++a) values(i, at.first + a) = at.value[0][a];
    const double angle = 2 * std::numbers::pi * u.greville(i);
    circle.row(i) << std::cos(angle), std::sin(angle);
  }
  const Eigen::MatrixXd control = values.partialPivLu().solve(circle);
  Eigen::Matrix3Xd points(3, n * v.control_point_count());
  for (int j = 0; j < v.control_point_count(); ++j)
    for (int i = 0; i < n; ++i)
      points.col(i + n * j) << (inner + (outer - inner) * v.greville(j)) * control.row(i).transpose(), 0;
  return {u, v, points};
}

TEST(EquilibriumPath, SlitAnnularPlateUnderALineForce) {
  ShellProblem problem(annulus(6, 10, 40), shell(21e6, 0, 0.03));
  problem.hold_edge(0, 0, {1, 1, 1}, 2);
  pull_edge(problem, 4, {0, 0, 0.8});
  follow(problem, {.load_steps = 20}, [&](const PathPoint& point) {
    for (const auto& [f, a, b] : {std::tuple(0.1, 4.277, 5.876), {0.5, 10.468, 13.768}, {1.0, 13.891, 17.528}}) {
      if (!at(point, f)) continue;
      EXPECT_NEAR(problem.moved(1, 0).z(), a, 0.01 * a) << f;
      EXPECT_NEAR(problem.moved(1, 1).z(), b, 0.01 * b) << f;
    }
  });
  EXPECT_GT(problem.moved(1, 1).z(), 17);
}

// The point that is pushed goes in by more than the one that is pulled goes out.
TEST(EquilibriumPath, HemisphereWithAHoleUnderPointForces) {
  ShellProblem problem(refined(sphere_part(10, 72 * one_degree), 3, 22, 22), shell(6.825e7, 0.3, 0.04));
  problem.mirror_edge(0, 0, 1);
  problem.mirror_edge(0, 1, 0);
  problem.hold(problem.edge(1, 1, 0), {0, 0, 1});
  problem.pull(problem.edge(1, 0, 0), {-200, 0, 0});
  problem.pull(problem.edge(1, 0, problem.along(1) - 1), {0, 200, 0});
  follow(problem, {.load_steps = 10}, [&](const PathPoint& point) {
    for (const auto& [f, out, in] : {std::tuple(0.1, 1.499, 1.840), {0.5, 3.406, 5.902}, {1.0, 4.067, 8.178}}) {
      if (!at(point, f)) continue;
      EXPECT_NEAR(problem.moved(1, 0).y(), out, 0.01 * out) << f;
      EXPECT_NEAR(-problem.moved(0, 0).x(), in, 0.01 * in) << f;
    }
  });
  EXPECT_GT(problem.moved(1, 0).y(), 4);
}

// An eighth of an open cylinder pulled outwards: it snaps from bending to stretching at half the load. Under the force
// itself the solution of a shell without shear has a point that meshes resolve slowly.
TEST(EquilibriumPath, PulloutOfAnOpenCylinder) {
  ShellProblem problem(refined(cylinder_part(4.953, right_angle, 10.35 / 2), 3, 16, 16), shell(10.5e6, 0.3125, 0.094));
  problem.mirror_edge(0, 0, 0);
  problem.mirror_edge(0, 1, 2);
  problem.mirror_edge(1, 0, 1);
  problem.pull(problem.edge(0, 0, 0), {0, 0, 10000});
  follow(problem, {.load_steps = 20}, [&](const PathPoint& point) {
    for (const auto& [f, b, c] :
         {std::tuple(0.1, 2.217, 2.293), {0.4, 3.443, 3.632}, {0.7, 4.385, 3.378}, {1.0, 4.551, 3.269}}) {
      if (!at(point, f)) continue;
      EXPECT_NEAR(-problem.moved(1, 0).x(), b, 0.01 * b) << f;
      EXPECT_NEAR(-problem.moved(1, 1).x(), c, 0.01 * c) << f;
    }
  });
  EXPECT_LT(-problem.moved(1, 1).x(), 3.4);
}

ShellProblem hinged_roof(double thickness, int spans) {
  ShellProblem problem(refined(cylinder_part(2540, 0.1, 254), 3, spans, spans), shell(3102.75, 0.3, thickness));
  problem.mirror_edge(0, 0, 0);
  problem.mirror_edge(1, 0, 1);
  problem.hold_edge(0, 1, {1, 1, 1});
  problem.pull(problem.edge(0, 0, 0), {0, 0, -750});
  return problem;
}

// Pushed down at its crown the roof carries no more than its limit load, snaps through and carries again from the least
// load on. At a given depth the load is up to 2 % above the table's, probably as that shell gives under the force
// by shear as well.
TEST(EquilibriumPath, HingedRoofsCarryTheirLimitLoads) {
  constexpr double between = 15;  // mm, of depth
  for (const auto& [thickness, most, least] : {std::tuple(12.7, 0.7421, 0.1729), {6.35, 0.1953, -0.1288}}) {
    ShellProblem problem = hinged_roof(thickness, 6);
    double upper = 0, lower = 1;
    bool unstable = false;
    const PathPoint end = follow(problem, {.load_steps = 80, .arc_length = true}, [&](const PathPoint& point) {
      const double depth = -problem.moved(0, 0).z();
      if (depth < between) upper = std::max(upper, point.factor);
      if (depth > between) lower = std::min(lower, point.factor);
      unstable = unstable || point.negative > 0;
    });
    EXPECT_NEAR(upper, most, 0.01 * most) << thickness;
    EXPECT_NEAR(lower, least, 0.02 * std::abs(least)) << thickness;
    EXPECT_TRUE(unstable);
    EXPECT_EQ(end.negative, 0);
    EXPECT_EQ(end.factor, 1);
  }
}

// Of the stiffness at the state, springs in place of the pins.
int negative_eigenvalues(const ShellProblem& problem) {
  const MechanicalSystem& system = problem.system();
  const ConstraintRows& rows = system.projection->rows();
  const ComposedRows composed = compose(*system.map, rows);
  NodeForces forces(system);
  forces.at(problem.state.t, problem.state.x, 1);
  RowMatrix matrix(composed.free, system.node_mass, &forces.pattern());
  matrix.scale = 0;
  for (std::size_t p = 0; p < rows.place.size(); ++p) {
    const Eigen::Vector3d stiff = 1e12 * rows.place[p].axes;
    matrix.blocks[p] = {stiff.x(), stiff.y(), stiff.z()};
  }
  return matrix.factorise_any(&forces.hessian(problem.state.x, false)).value();
}

// So large a residual that a step's end lies apart from where its last matrix was made.
TEST(EquilibriumPath, NegativeEigenvaluesAreThoseOfTheAcceptedState) {
  ShellProblem problem = hinged_roof(12.7, 4);
  int changes = 0, last = 0;
  follow(problem, {.load_steps = 40, .arc_length = true, .residual = 0.1}, [&](const PathPoint& point) {
    EXPECT_EQ(point.negative, negative_eigenvalues(problem)) << point.steps;
    changes += point.negative != last ? 1 : 0;
    last = point.negative;
  });
  EXPECT_EQ(changes, 2);  // beyond the limit load, and beyond the least load
}

TEST(EquilibriumPath, IndefiniteFactorSolvesAndCountsNegativeEigenvalues) {
  Eigen::Matrix3d a;
  a << 2, 1, 0, 1, -3, 1, 0, 1, 1;
  IndefiniteFactor factor({{0, 2, 4, 5}, {0, 1, 1, 2, 2}});
  EXPECT_EQ(factor.factorise(std::vector<double>{2, 1, -3, 1, 1}), 1);
  Eigen::VectorXd x(3);
  const Eigen::Vector3d wanted(1, -2, 0.5);
  factor.solve(a * wanted, x);
  EXPECT_LT((x - wanted).norm(), 1e-14);
  EXPECT_EQ(factor.factorise(std::vector<double>{2, 0, std::nan(""), 0, 1}), std::nullopt);
}

TEST(EquilibriumPath, StepsWithoutBalanceAreHalvedAndLeadToTheSameEnd) {
  ShellProblem fine = cantilever(6), coarse = cantilever(6);
  const auto on = [](const PathPoint&) {};
  EXPECT_EQ(follow(fine, {.load_steps = 20}, on).halvings, 0);
  const PathPoint end = follow(coarse, {.load_steps = 1, .max_iterations = 6}, on);
  EXPECT_GT(end.halvings, 0);
  EXPECT_LT((fine.moved(1, 0.5) - coarse.moved(1, 0.5)).norm(), 1e-6);
}

// No length is tried twice: halved is what was tried, not what might have been.
TEST(EquilibriumPath, HalvesWhatItTried) {
  ShellProblem problem = cantilever(6);
  problem.finish();
  StepWork work;
  // A tenth of the load is left: 0.1, 0.05, ... 0.0016.
  EquilibriumPath by_load(problem.system(), {.load_steps = 1, .max_iterations = 1});
  PathPoint point;
  point.factor = 0.9;
  point.length = 1;
  point.shortest = 1.0 / 1024;
  EXPECT_NE(by_load.step(problem.state, 1, point, work).trouble, "");
  EXPECT_EQ(point.halvings, 6);
  EXPECT_EQ(point.iterations, 7);
  // A step of the path takes a tenth of the load at most, however long it might be.
  EquilibriumPath by_length(problem.system(), {.load_steps = 10, .arc_length = true, .max_iterations = 1});
  PathPoint along;
  along.length = 10;
  along.shortest = 0.01;
  PathPoint farther = along;
  farther.length = 1e6;
  EXPECT_NE(by_length.step(problem.state, 1, along, work).trouble, "");
  EXPECT_NE(by_length.step(problem.state, 1, farther, work).trouble, "");
  EXPECT_GT(along.halvings, 1);
  EXPECT_EQ(along.halvings, farther.halvings);
}

TEST(EquilibriumPath, WhatCanNotGoOnSaysWhereAndLeavesTheState) {
  ShellProblem problem = cantilever(6);
  problem.finish();
  EquilibriumPath path(problem.system(), {.load_steps = 2, .max_iterations = 1});
  PathPoint point;
  StepWork work;
  const Eigen::VectorXd x = problem.state.x;
  const PathReport report = path.step(problem.state, 1, point, work);
  for (const char* part : {"beyond 0 of the loads", "no balance in 1 iterations"})
    EXPECT_NE(report.trouble.find(part), std::string::npos) << report.trouble;
  EXPECT_EQ(problem.state.x, x);
  EXPECT_EQ(point.factor, 0);
  EXPECT_EQ(point.steps, 0);
}

}  // namespace
}  // namespace toile
