// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/scheme/verlet.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <numeric>

#include "analysis/projection/fast_projection.h"
#include "analysis/projection/lagrange_newton.h"
#include "analysis/projection/primal_dual.h"
#include "analysis/scheme/implicit.h"
#include "support/near.h"
#include "support/panels.h"

namespace toile {
namespace {

const Eigen::Vector3d gravity(0, 0, -9.81);

enum class Solver { newton, paper, lagrange };

// A square panel with strain rows at its knot vertices, control points held, material points pinned.
struct Scene {
  ShellModel model;
  AffineMap map;
  std::unique_ptr<ConstraintSolver> projection;
  MechanicalSystem system;
  DynamicState state;

  struct Options {
    double size = 1;
    int degree = 2, spans = 8;
    Fabric fabric = {};
    std::vector<int> fixed = {};
    AffineMap::Motion motion = {};  // unset: fixed control points stay at rest
    std::vector<Eigen::Vector2d> pins = {};
    bool limits = true;
    bool gravity = true;
    ProjectionOptions projection = {};
    Solver solver = Solver::newton;
    PrimalDualOptions newton = {};
    double stiffness = 1170;  // N/m, of the strain limit: ten weights of a square metre at 1 % strain
  };

  explicit Scene(const Options& o)
      : model([&] {
          std::vector<ClothPanel> panels;
          panels.push_back(test::make_flat_panel(o.size, o.size, o.degree, o.spans, o.spans, o.fabric));
          return panels;
        }()),
        map(
            AffineMap::identity(model.point_count()), o.fixed,
            o.motion ? o.motion : [rest = model.rest(), fixed = o.fixed](std::size_t k, double) {
              return Eigen::Vector3d(rest.segment<3>(3 * fixed[k]));
            }) {
    system.body = &model;
    system.potentials = model.potentials();
    system.map = &map;
    system.node_mass = map.reduce_scalar(model.lumped_mass());
    system.node_drag = map.reduce_scalar(model.lumped_drag());
    system.loads.force = test::weight_of(model, o.gravity ? gravity : Eigen::Vector3d(0, 0, 0));

    ConstraintRows rows;
    std::vector<std::vector<ConstraintPoint>> points(1);
    const NurbsSurface& rest = model.panels()[0].rest;
    for (double v : rest.v().breaks())
      for (double u : rest.u().breaks()) {
        points[0].emplace_back();
        points[0].back().u = u, points[0].back().v = v;
      }
    if (o.limits) rows.strain = strain_rows(model, map, points);
    for (StrainRow& row : rows.strain) row.stiffness = o.stiffness * row.area;
    for (const Eigen::Vector2d& uv : o.pins) {
      const Eigen::Vector3d place = rest(uv[0], uv[1]);
      rows.place.push_back({model.place(0, uv[0], uv[1]), 0, [place](double) { return place; }});
    }
    if (!rows.strain.empty() || !rows.place.empty()) projection = solver(o, std::move(rows));
    system.projection = projection.get();
    state.x = map.restrict(model.rest());
    state.v = Eigen::VectorXd::Zero(state.x.size());
    initialise(system, state);
  }

  std::unique_ptr<ConstraintSolver> solver(const Options& o, ConstraintRows rows) const {
    if (o.solver == Solver::lagrange)
      return std::make_unique<LagrangeNewton>(map, system.node_mass, std::move(rows), o.projection);
    if (o.solver == Solver::paper)
      return std::make_unique<FastProjection>(map, system.node_mass, std::move(rows), o.projection);
    return std::make_unique<PrimalDual>(map, system.node_mass, std::move(rows), o.newton);
  }

  Eigen::VectorXd places() const {
    Eigen::VectorXd q(3 * map.control_points());
    map.expand(state.x, state.t, q);
    return q;
  }
};

Fabric without_drag() {
  Fabric fabric;
  fabric.drag = 0;
  return fabric;
}

double run(Scene& scene, double dt, double until) {
  const int steps = static_cast<int>(std::lround(until / dt));
  for (int k = 0; k < steps; ++k) EXPECT_TRUE(step(scene.system, scene.state, dt).finite);
  return scene.state.t;
}

TEST(Verlet, FreeFallIsExact) {
  Scene scene({.fabric = without_drag()});
  const Eigen::VectorXd start = scene.places();
  run(scene, 4e-3, 0.5);
  const Eigen::VectorXd end = scene.places();
  for (int i = 0; i < scene.map.control_points(); ++i)
    EXPECT_LT(((end - start).segment<3>(3 * i) - 0.5 * 0.25 * gravity).norm(), 1e-10);
}

TEST(Verlet, DragLeadsToTerminalVelocityAndFollowsTheWind) {
  Scene scene({.gravity = true});
  scene.system.loads.wind = Eigen::Vector3d(1, -2, 0);
  initialise(scene.system, scene.state);
  run(scene, 4e-3, 5);
  const Fabric fabric;
  const Eigen::Vector3d terminal = scene.system.loads.wind + gravity * fabric.density / fabric.drag;
  const double left = std::exp(-fabric.drag / fabric.density * 5);
  for (int k = 0; k < scene.map.nodes(); ++k)
    EXPECT_LT((scene.state.v.segment<3>(3 * k) - terminal).norm(), 1.05 * left * terminal.norm());
}

// Energy less work where the velocity obeys the constraints: in the middle of each step, or at its end.
class Balance {
 public:
  explicit Balance(bool at_end = false) : at_end_(at_end) {}
  double operator()(const StepReport& report) {
    const double elastic = report.elastic.total() + report.limit_energy;
    const double work = report.load_work + report.drag_work + report.motion_work;
    const double balance = at_end_ ? report.kinetic_end - report.kick_end + elastic - work_ - work
                                   : report.kinetic + 0.5 * (elastic_ + elastic) - work_ - 0.5 * work;
    elastic_ = elastic;
    work_ += work;
    return balance;
  }

 private:
  bool at_end_;
  double elastic_ = 0, work_ = 0;
};

// The law that redundancy breaks most easily: two pinned corners make the rows of the edge between them dependent.
TEST(Verlet, EnergyOfAnUndampedProjectedRunNeverRises) {
  for (const Solver solver : {Solver::newton, Solver::paper, Solver::lagrange})
    for (double dt : {4e-3, 2e-3, 1e-3}) {
      Scene scene({.fabric = without_drag(), .fixed = {0, 9}, .solver = solver});
      Balance balance(solver == Solver::newton);
      double work = 0, most_work = 0, highest = 0;
      for (int k = 0; k < std::lround(1.2 / dt); ++k) {
        const StepReport report = step(scene.system, scene.state, dt);
        ASSERT_TRUE(report.finite);
        ASSERT_TRUE(report.projection.converged) << "at step " << k << ": " << report.projection.strain_violation;
        work += report.load_work;
        most_work = std::max(most_work, work);
        // The middle of a step leaves out what half a step's acceleration adds: the law holds with it too, but for the
        // paper's variant, which is above by 3e-4 of the work at 4 ms.
        const double left_out = solver == Solver::lagrange ? report.kick : 0;
        highest = std::max(highest, balance(report) + left_out);
      }
      EXPECT_GT(most_work, 0.5);
      EXPECT_LT(highest, 2e-6 * most_work) << dt << " by solver " << static_cast<int>(solver);
    }
}

// A step remembers nothing of the size of the one before. (With three steps' forces kept, 7 % were lost here.)
TEST(Verlet, AlternatingStepSizesLoseNoMoreThanEqualOnes) {
  const auto lost = [](double dt, double other) {  // of gravity's work, in 0.6 s
    Scene scene({.fabric = without_drag(), .fixed = {0, 9}});
    Balance balance(true);
    double work = 0, left = 0;
    for (int k = 0; scene.state.t < 0.6; ++k) {
      const StepReport report = step(scene.system, scene.state, k % 2 == 0 ? dt : other);
      EXPECT_TRUE(report.projection.converged);
      work += report.load_work;
      left = balance(report);
    }
    return -left / work;
  };
  const double bound = 4.2e-3;  // of the cloth alone
  const double equal = lost(0.6 * bound, 0.6 * bound);
  EXPECT_LT(std::abs(equal), 2.5e-3);
  EXPECT_LT(std::abs(lost(0.6 * bound, 0.06 * bound) - equal), 1e-3);
  EXPECT_LT(std::abs(lost(0.6 * bound, 0.001 * bound) - equal), 1e-3);
}

TEST(Verlet, EnergyBalancesWithoutProjectionToSecondOrder) {
  double previous = 0;
  for (double dt : {2e-3, 1e-3, 5e-4}) {
    Fabric fabric;
    fabric.membrane = {.weft = 200, .warp = 200, .shear = 80};
    fabric.bending.kappa_reg = 3;
    Scene scene({.fabric = fabric, .fixed = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, .limits = false});
    Balance balance;
    double worst = 0, scale = 0;
    for (int k = 0; k < std::lround(0.3 / dt); ++k) {
      const StepReport report = step(scene.system, scene.state, dt);
      scale += report.load_work;
      worst = std::max(worst, std::abs(balance(report)));
    }
    EXPECT_LT(worst, 0.01 * scale);
    if (previous > 0) {
      EXPECT_LT(worst, 0.35 * previous);
    }
    previous = worst;
  }
}

TEST(Verlet, MovedPinsDoTheWorkThatTheClothTakesUp) {
  // The upper edge is lifted; all energy that arrives comes through the pins.
  std::vector<int> edge{0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  const ShellModel reference = [] {
    std::vector<ClothPanel> panels;
    panels.push_back(test::make_flat_panel(1, 1, 2, 8, 8));
    return ShellModel(std::move(panels));
  }();
  const auto motion = [rest = reference.rest(), edge](std::size_t k, double t) {
    const double s = std::clamp(t / 0.4, 0.0, 1.0);
    return Eigen::Vector3d(rest.segment<3>(3 * edge[k]) + Eigen::Vector3d(0, -0.2, 0.1) * s * s * (3 - 2 * s));
  };
  double previous = 0;
  for (double dt : {2e-3, 1e-3}) {
    Fabric fabric;
    fabric.membrane = {.weft = 200, .warp = 200, .shear = 80};
    Scene scene({.fabric = fabric, .fixed = edge, .motion = motion, .limits = false, .gravity = false});
    Balance balance;
    double motion_work = 0, worst = 0;
    for (int k = 0; k < std::lround(0.5 / dt); ++k) {
      const StepReport report = step(scene.system, scene.state, dt);
      motion_work += report.motion_work;
      worst = std::max(worst, std::abs(balance(report)));
    }
    EXPECT_GT(motion_work, 0.01);
    EXPECT_LT(worst, 0.02 * motion_work);
    if (previous > 0) {
      EXPECT_LT(worst, 0.3 * previous) << "the work of pins is of second order";
    }
    previous = worst;
  }
}

// A regularised moment law of little bite (kappa_reg = 1/m): with the sample's 0.03/m it chatters where cloth is nearly
// flat, which moves the corner by 0.3 mm from one step size to another and hides the order.
TEST(Verlet, HalvingTheStepMovesTheFreeCornerByLessThanHalfOfTheChangeBefore) {
  Fabric fabric;
  fabric.bending.kappa_reg = 1;
  for (double until : {0.3, 0.6}) {
    std::vector<Eigen::VectorXd> q;
    for (double dt : {2e-3, 1e-3, 5e-4, 2.5e-4}) {
      Scene scene({.fabric = fabric, .fixed = {0, 9}, .newton = {.force_residual = 1e-4, .law_residual = 1e-4}});
      run(scene, dt, until);
      q.push_back(scene.places());
    }
    double previous = 0;
    for (std::size_t k = 1; k < q.size(); ++k) {
      const double change = (q[k] - q[k - 1]).tail<3>().norm();
      if (k > 1) {
        EXPECT_LT(change, 0.4 * previous) << "until " << until << ", halving " << k;
      }
      previous = change;
    }
    EXPECT_LT((q.front() - q.back()).tail<3>().norm(), 5e-4) << until;
  }
}

// With the sample's own law: the paper's variant is 25 mm off at 4 ms.
TEST(Verlet, TheFreeCornerIsWithinHalfAMillimetreAtTheLargestStep) {
  for (double until : {0.3, 0.6}) {
    std::vector<Eigen::Vector3d> corner;
    for (double dt : {4e-3, 1e-3, 2.5e-4}) {
      Scene scene({.fixed = {0, 9}});
      run(scene, dt, until);
      corner.push_back(scene.places().tail<3>());
    }
    EXPECT_LT((corner[0] - corner[2]).norm(), 5e-4) << until;
    EXPECT_LT((corner[1] - corner[2]).norm(), 3e-4) << until;
  }
}

// Both take the gradients where the step ends, within its square: the candidate's or the end's.
TEST(Verlet, LagrangeNewtonAndTheProjectionDifferByTheSquareOfTheStep) {
  Fabric fabric;
  fabric.bending.kappa_reg = 3;  // a smooth law: its kink hides the order
  const ProjectionOptions options{.residual = 1e-9};
  double previous = 0;
  for (double dt : {2e-3, 1e-3, 5e-4}) {
    Scene newton({.fabric = fabric, .fixed = {0, 9}, .projection = options, .solver = Solver::lagrange}),
        projection({.fabric = fabric, .fixed = {0, 9}, .projection = options, .solver = Solver::paper});
    run(newton, dt, 0.2);
    run(projection, dt, 0.2);
    const double distance = (newton.places() - projection.places()).cwiseAbs().maxCoeff();
    EXPECT_GT(distance, 1e-9);
    if (previous > 0) {
      EXPECT_LT(distance, 0.3 * previous) << dt;
    }
    previous = distance;
  }
}

void expect_weight_on_pins(Solver solver) {
  Fabric fabric;
  fabric.drag = 0.8;
  Scene scene({.size = 0.3, .spans = 4, .fabric = fabric, .fixed = {0, 5}, .pins = {{0.5, 0.9}}, .solver = solver});
  const double dt = 5e-4;
  run(scene, dt, 4);
  const Reactions pins = reactions(scene.system, scene.state, dt);
  const Eigen::Vector3d total = pins.fixed.rowwise().sum() + pins.place.rowwise().sum();
  const double weight = 0.3 * 0.3 * fabric.density * 9.81;
  EXPECT_LT((total - Eigen::Vector3d(0, 0, weight)).norm(), 1e-3 * weight);
  EXPECT_GT(pins.place(2, 0), 0.1 * weight);
  EXPECT_GT(pins.fixed(2, 0), 0.01 * weight);
  expect_near_rel(pins.fixed(2, 0), pins.fixed(2, 1), 1e-2);
}
TEST(Verlet, PinsOfAHangingClothCarryItsWeight) {
  for (const Solver solver : {Solver::newton, Solver::paper, Solver::lagrange}) {
    SCOPED_TRACE(static_cast<int>(solver));
    expect_weight_on_pins(solver);
  }
}

// Cloth that its pins move as a whole: they give what its mass, its weight and the air ask for.
TEST(Verlet, PinsThatMoveTheClothAccelerateItAgainstTheAir) {
  std::vector<int> all(100);
  std::iota(all.begin(), all.end(), 0);
  const ShellModel reference({test::make_flat_panel(1, 1, 2, 8, 8)});
  const Eigen::Vector3d acceleration(3, -2, 7), wind(-4, 0, 1);
  const auto motion = [&, rest = reference.rest()](std::size_t k, double t) {
    return Eigen::Vector3d(rest.segment<3>(3 * static_cast<Eigen::Index>(k)) + 0.5 * t * t * acceleration);
  };
  Scene scene({.fixed = all, .motion = motion, .limits = false});
  scene.system.loads.wind = wind;
  initialise(scene.system, scene.state);
  constexpr double dt = 1e-4;
  scene.state.t = 0.5;
  const Eigen::Vector3d total = reactions(scene.system, scene.state, dt).fixed.rowwise().sum();
  const Eigen::Vector3d velocity = (0.5 - 0.5 * dt) * acceleration;  // in the middle of the step
  const Fabric fabric;
  const Eigen::Vector3d expected = fabric.density * (acceleration - gravity) + fabric.drag * (velocity - wind);
  EXPECT_LT((total - expected).norm(), 1e-6 * expected.norm());
}

// The cloth's own forces and the constraints' have no sum, and no moment about where they act: with velocities between
// the steps sum m v is constant, and sum m x x v nearly so.
TEST(Verlet, FreeClothKeepsItsMomentumAndItsSpin) {
  Fabric fabric;
  fabric.drag = 0;
  Scene scene({.spans = 5, .fabric = fabric, .gravity = false});
  DynamicState& state = scene.state;
  const Eigen::VectorXd& mass = scene.system.node_mass;
  for (int k = 0; k < mass.size(); ++k) {
    const Eigen::Vector3d x = state.x.segment<3>(3 * k) - Eigen::Vector3d(0.5, 0.5, 0);
    state.v.segment<3>(3 * k) = Eigen::Vector3d(1, -2, 0.5) + Eigen::Vector3d(0.3, 2, 3).cross(x);
    state.v[3 * k + 2] += 2 * std::sin(5 * x.x()) * x.y();  // it flutters as well
  }
  initialise(scene.system, state);
  struct Motion {
    Eigen::Vector3d momentum, spin;
  };
  constexpr double dt = 1e-3;
  double pushed = 0;
  const auto advance = [&] {
    const Eigen::VectorXd before = state.x;
    const StepReport report = step(scene.system, state, dt);
    EXPECT_TRUE(report.projection.converged && !report.projection.damped);
    pushed = std::max(pushed, scene.projection->memory().strain_multipliers.cwiseAbs().maxCoeff() / (dt * dt));
    Motion motion{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    for (int k = 0; k < mass.size(); ++k) {
      const Eigen::Vector3d v = (state.x - before).segment<3>(3 * k) / dt;
      motion.momentum += mass[k] * v;
      motion.spin += mass[k] * Eigen::Vector3d(before.segment<3>(3 * k)).cross(v);
    }
    return motion;
  };
  const Motion first = advance();
  for (int k = 0; k < 400; ++k) {
    const Motion now = advance();
    EXPECT_LT((now.momentum - first.momentum).norm(), 1e-11 * first.momentum.norm());
    EXPECT_LT((now.spin - first.spin).norm(), 1e-5 * first.spin.norm());  // of the third order in the step
  }
  EXPECT_GT(pushed, 1e-4);  // the limits had something to do
}

TEST(Verlet, AStepIntoNonsenseLeavesTheStateAsItWas) {
  Scene scene({.fixed = {0, 9}});
  run(scene, 4e-3, 0.1);
  scene.system.loads.force[200] = std::numeric_limits<double>::quiet_NaN();
  const DynamicState before = scene.state;
  EXPECT_FALSE(step(scene.system, scene.state, 4e-3).finite);
  EXPECT_EQ(scene.state.t, before.t);
  EXPECT_EQ(scene.state.x, before.x);
  EXPECT_EQ(scene.state.v, before.v);
  EXPECT_EQ(scene.state.a, before.a);
}

TEST(Verlet, RestartingFromAStateContinuesBitByBit) {
  for (const Solver solver : {Solver::newton, Solver::paper, Solver::lagrange}) {
    Scene one({.fixed = {0, 9}, .solver = solver}), two({.fixed = {0, 9}, .solver = solver});
    run(one, 4e-3, 0.2);
    two.state = one.state;
    run(one, 4e-3, 0.1);
    run(two, 4e-3, 0.1);
    EXPECT_EQ(one.state.x, two.state.x);
    EXPECT_EQ(one.state.v, two.state.v);
  }
}

constexpr ImplicitRule all_rules[] = {ImplicitRule::backward_euler, ImplicitRule::bdf2, ImplicitRule::newmark};

DynamicState implicit_run(Scene& scene, ImplicitRule rule, double dt, double until, double residual = 1e-3) {
  ImplicitScheme scheme(scene.system, {}, rule, {.residual = residual});
  StepWork work;
  for (int k = 0; k < std::lround(until / dt); ++k) {
    const StepReport report = scheme.step(scene.state, dt, work);
    EXPECT_TRUE(report.finite && report.projection.converged) << k;
  }
  return scene.state;
}

TEST(Implicit, FreeFallIsExactBySecondOrderRules) {
  for (const ImplicitRule rule : all_rules) {
    Scene scene({.spans = 4, .fabric = without_drag()});
    const Eigen::VectorXd start = scene.places();
    implicit_run(scene, rule, 0.05, 0.5);
    // Backward Euler's speed of each step is that at its end.
    const double fallen = rule == ImplicitRule::backward_euler ? 0.5 * 0.5 * (0.5 + 0.05) : 0.5 * 0.25;
    for (int i = 0; i < scene.map.control_points(); ++i)
      EXPECT_LT(((scene.places() - start).segment<3>(3 * i) - fallen * gravity).norm(), 1e-9);
  }
}

TEST(Implicit, DragLeadsToTerminalVelocityAtAnyStep) {
  for (const ImplicitRule rule : {ImplicitRule::backward_euler, ImplicitRule::bdf2}) {
    Scene scene({.spans = 4});
    scene.system.loads.wind = Eigen::Vector3d(1, -2, 0);
    implicit_run(scene, rule, 0.5, 15);
    const Fabric fabric;
    const Eigen::Vector3d terminal = scene.system.loads.wind + gravity * fabric.density / fabric.drag;
    for (int k = 0; k < scene.map.nodes(); ++k)
      EXPECT_LT((scene.state.v.segment<3>(3 * k) - terminal).norm(), 1e-4 * terminal.norm());
  }
}

// Against small steps of Verlet, of cloth without a limit.
TEST(Implicit, StepsHaveTheOrderOfTheirRule) {
  Fabric fabric;
  fabric.membrane = {.weft = 20, .warp = 20, .shear = 8};
  fabric.bending.kappa_reg = 3;
  const Scene::Options options{.spans = 5, .fabric = fabric, .fixed = {0, 6}, .limits = false};
  Scene fine(options);
  run(fine, 1e-4, 0.16);
  const Eigen::VectorXd exact = fine.places();
  for (const ImplicitRule rule : all_rules) {
    std::vector<double> error;
    for (const double dt : {4e-3, 2e-3, 1e-3}) {
      Scene scene(options);
      implicit_run(scene, rule, dt, 0.16, 1e-6);
      error.push_back((scene.places() - exact).norm());
    }
    const double order = rule == ImplicitRule::backward_euler ? 0.9 : 1.85;
    EXPECT_GT(std::log2(error[0] / error[1]), order) << static_cast<int>(rule);
    EXPECT_GT(std::log2(error[1] / error[2]), order) << static_cast<int>(rule);
  }
}

TEST(Implicit, LargeStepsKeepTheLimitAndMakeNoEnergy) {
  for (const ImplicitRule rule : {ImplicitRule::backward_euler, ImplicitRule::bdf2})
    for (const double dt : {1.0 / 30, 1.0 / 120}) {
      Scene scene({.fabric = without_drag(), .fixed = {0, 9}});
      ImplicitScheme scheme(scene.system, {}, rule);
      StepWork work;
      double energy = 0, gained = 0, done = 0;
      for (int k = 0; k < std::lround(0.8 / dt); ++k) {
        const StepReport report = scheme.step(scene.state, dt, work);
        ASSERT_TRUE(report.finite && report.projection.converged) << dt << ' ' << k;
        EXPECT_LT(report.projection.strain_violation, 0.01);
        done += report.load_work;
        energy = report.kinetic_end + report.elastic.total() + report.limit_energy - done;
        gained = std::max(gained, energy);
      }
      EXPECT_GT(done, 0.15);
      EXPECT_LT(gained, 1e-3 * done) << dt;
    }
}

TEST(Implicit, PinsOfAHangingClothCarryItsWeight) {
  Fabric fabric;
  fabric.drag = 0.8;
  for (const ImplicitRule rule : {ImplicitRule::backward_euler, ImplicitRule::bdf2}) {
    Scene scene({.size = 0.3, .spans = 4, .fabric = fabric, .fixed = {0, 5}, .pins = {{0.5, 0.9}}});
    const double dt = 0.02;
    implicit_run(scene, rule, dt, 6);
    const Reactions pins = reactions(scene.system, scene.state, dt);
    const Eigen::Vector3d total = pins.fixed.rowwise().sum() + pins.place.rowwise().sum();
    const double weight = 0.3 * 0.3 * fabric.density * 9.81;
    EXPECT_LT((total - Eigen::Vector3d(0, 0, weight)).norm(), 1e-3 * weight);
    EXPECT_GT(pins.place(2, 0), 0.1 * weight);
  }
}

// A square plate on all four edges under an even load: w = 0.00406235 q a^4 / D in the middle. [Timoshenko &
// Woinowsky-Krieger 1959, art. 31] Without the coupling of moments D is the same and w is 0.00443.
TEST(Implicit, ASimplySupportedPlateBendsAsNavierSays) {
  const double a = 1, thickness = 0.01, load = 2e-4;
  const Fabric fabric = isotropic(1e6, 0.3, thickness);
  const int spans = 8, n = spans + 3;
  std::vector<int> edge;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      if (i == 0 || j == 0 || i == n - 1 || j == n - 1) edge.push_back(n * j + i);
  Scene scene(
      {.size = a, .degree = 3, .spans = spans, .fabric = fabric, .fixed = edge, .limits = false, .gravity = false});
  for (int i = 0; i < n * n; ++i)
    scene.system.loads.force[3 * i + 2] = load * scene.model.lumped_mass()[i] / fabric.density;
  scene.system.node_drag.setZero();
  ImplicitScheme scheme(scene.system, {}, ImplicitRule::backward_euler, {.residual = 1e-9});
  StepWork work;
  for (const double beta : {1.0, 1e3, 1e5})
    EXPECT_TRUE(scheme.equilibrate(scene.state, 0.1, beta, work).projection.converged);
  const double stiffness = 1e6 * std::pow(thickness, 3) / 12 / (1 - 0.3 * 0.3);
  const double middle = scene.model.state(0, 0.5, 0.5, scene.places()).position.z();
  expect_near_rel(middle, 0.00406235 * load * std::pow(a, 4) / stiffness, 1e-3);
}

TEST(Implicit, RestartingFromAStateContinuesBitByBit) {
  for (const ImplicitRule rule : all_rules) {
    Scene one({.spans = 5, .fixed = {0, 6}}), two({.spans = 5, .fixed = {0, 6}});
    implicit_run(one, rule, 0.01, 0.1);
    two.state = one.state;
    implicit_run(one, rule, 0.01, 0.1);
    implicit_run(two, rule, 0.01, 0.1);
    EXPECT_EQ(one.state.x, two.state.x);
    EXPECT_EQ(one.state.v, two.state.v);
  }
}

}  // namespace
}  // namespace toile
