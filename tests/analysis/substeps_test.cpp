// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/projection/substeps.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "analysis/flat_cloth.h"
#include "analysis/parallel/workers.h"
#include "analysis/scheme/time_step.h"
#include "analysis/scheme/verlet.h"
#include "geometry/error.h"
#include "support/near.h"
#include "support/panels.h"

namespace toile {
namespace {

using test::disturbed;
using test::flat_cloth;
using test::FlatCloth;
using test::free_map;
using test::momenta;
using test::scalar_row;
using test::strain;

// At the Greville abscissae of the derivatives, which are knots where p = 2.
std::vector<StrainRow> rows_of(const FlatCloth& c, double stiffness) {
  std::vector<double> at;
  const int p = c.knots.degree();
  for (int i = 0; i + 1 < c.n; ++i) {
    double sum = 0;
    for (int k = 1; k < p; ++k) sum += c.knots[i + 1 + k];
    at.push_back(sum / (p - 1));
  }
  std::vector<StrainRow> rows;
  int point = 0;
  for (const double v : at) {
    for (const double u : at) {
      for (const int which : {1, 2})
        rows.push_back({.row = scalar_row(c, u, v, which), .point = point, .warp = which == 2, .uv = {u, v}});
      ++point;
    }
  }
  for (StrainRow& row : rows) {
    row.area = 1.0 / static_cast<double>(at.size() * at.size());
    row.stiffness = stiffness * row.area;
  }
  return rows;
}

AffineMap moving_corners(const FlatCloth& c, const Eigen::Vector3d& velocity) {
  const std::vector<int> corners{0, c.n - 1};
  return AffineMap(AffineMap::identity(c.n * c.n), corners, [c, corners, velocity](std::size_t k, double t) {
    return Eigen::Vector3d(c.rest.segment<3>(3 * corners[k]) + t * velocity);
  });
}

// Places and velocities of a cloth under its limits and an even acceleration.
struct Motion {
  Eigen::VectorXd x, v;
  ConstraintForces forces = {};
  double t = 0;

  ProjectionReport step(Substeps& solver, double dt, const Eigen::Vector3d& g = Eigen::Vector3d::Zero()) {
    const Eigen::VectorXd start = x, a = g.replicate(x.size() / 3, 1);
    x += dt * v + 0.5 * dt * dt * a;
    v += dt * a;
    t += dt;
    return solver.step(x, v, t, start, dt, forces);
  }
};

// One node on a row, all others held: leapfrog turns by the phase acos(1 - (omega h)^2 / 2), and a step of n substeps
// by n of them.
TEST(Substeps, ASmallVibrationTurnsByLeapfrogsPhase) {
  const FlatCloth c = flat_cloth(2, 4);
  const int node = 2 * c.n + 2;
  std::vector<int> others;
  for (int i = 0; i < c.n * c.n; ++i)
    if (i != node) others.push_back(i);
  const AffineMap map(AffineMap::identity(c.n * c.n), others,
                      [&](std::size_t k, double) { return Eigen::Vector3d(c.rest.segment<3>(3 * others[k])); });
  StrainRow row;
  for (const StrainRow& r : rows_of(c, 100))
    if (!r.warp && std::ranges::find(r.row.index, node) != r.row.index.end()) row = r;
  double d = 0;
  for (std::size_t k = 0; k < row.row.index.size(); ++k)
    if (row.row.index[k] == node) d = row.row.value[k];
  const Eigen::VectorXd mass = map.reduce_scalar(c.mass);
  const double omega = std::abs(d) * std::sqrt(row.stiffness / mass[0]);
  Substeps solver(map, mass, {{row}, {}}, {.damping = 0});
  for (const double phase : {0.1, 1.0, 5.0, 70.0}) {
    const double dt = phase / omega, size = 1e-7;
    Motion motion{map.restrict(c.rest), Eigen::VectorXd::Zero(3)};
    motion.x[0] += size;
    const int n = motion.step(solver, dt).iterations;
    EXPECT_LE(phase / n, 2.0) << phase;
    EXPECT_GE(phase / n, std::min(phase, 1.4)) << phase;
    const double turned = n * std::acos(1 - 0.5 * std::pow(phase / n, 2));
    EXPECT_NEAR((motion.x[0] - c.rest[3 * node]) / size, std::cos(turned), 1e-5) << phase;
    EXPECT_EQ(motion.x[2], 0);
  }
}

TEST(Substeps, ProductsOfANetAndAnyRowsGiveTheSame) {
  for (const int degree : {2, 3, 4}) {
    const FlatCloth c = flat_cloth(degree, 7);
    const AffineMap map = moving_corners(c, {0.3, 0, 0.1});
    ConstraintRows rows{rows_of(c, 500), {}};
    rows.place.push_back({scalar_row(c, 0.4, 1, 0), 0, [](double t) { return Eigen::Vector3d(0.4, 1 + 0.2 * t, t); }});
    const Eigen::VectorXd mass = map.reduce_scalar(c.mass);
    Substeps net(map, mass, rows, {.nets = {{0, c.n, c.n}}}), any(map, mass, rows);
    ASSERT_EQ(net.nets(), 1) << degree;
    ASSERT_EQ(any.nets(), 0);
    const Eigen::VectorXd x = map.restrict(disturbed(c.rest, 0.005, 3));
    Motion a{x, Eigen::VectorXd::Zero(x.size())}, b = a;
    for (int k = 0; k < 3; ++k) {
      const ProjectionReport of_net = a.step(net, 0.02, {0, 0, -9.81}), of_any = b.step(any, 0.02, {0, 0, -9.81});
      EXPECT_GT(of_net.iterations, 3);
      EXPECT_EQ(of_net.iterations, of_any.iterations);
    }
    EXPECT_GT((a.x - x).norm(), 0.01);
    EXPECT_LT((a.x - b.x).lpNorm<Eigen::Infinity>(), 1e-12) << degree;
    EXPECT_LT((a.v - b.v).lpNorm<Eigen::Infinity>(), 1e-9) << degree;
    EXPECT_LT((net.memory().strain_impulses - any.memory().strain_impulses).norm(),
              1e-9 * any.memory().strain_impulses.norm());
  }
}

// Rows across the net's lines are no products.
TEST(Substeps, TurnedThreadsAreNoNet) {
  const FlatCloth c = flat_cloth(2, 6);
  std::vector<StrainRow> rows = rows_of(c, 500);
  for (std::size_t r = 0; r < rows.size(); r += 2) {
    ScalarRow& weft = rows[r].row;
    for (std::size_t k = 0; k < rows[r + 1].row.index.size(); ++k) {
      weft.index.push_back(rows[r + 1].row.index[k]);
      weft.value.push_back(0.5 * rows[r + 1].row.value[k]);
    }
  }
  EXPECT_EQ(Substeps(free_map(c), c.mass, {rows, {}}, {.nets = {{0, c.n, c.n}}}).nets(), 0);
}

TEST(Substeps, ThreadsGiveTheSameBits) {
  const FlatCloth c = flat_cloth(2, 24);
  const AffineMap map = moving_corners(c, {0.3, 0, 0.1});
  const Eigen::VectorXd mass = map.reduce_scalar(c.mass);
  Workers workers(3);
  for (const bool products : {true, false}) {
    SubstepsOptions options;
    if (products) options.nets = {{0, c.n, c.n}};
    Substeps alone(map, mass, {rows_of(c, 500), {}}, options), shared(map, mass, {rows_of(c, 500), {}}, options);
    shared.use_threads(&workers);
    ASSERT_EQ(alone.nets(), products ? 1 : 0);
    const Eigen::VectorXd x = map.restrict(disturbed(c.rest, 0.002, 3));
    Motion a{x, Eigen::VectorXd::Zero(x.size())}, b = a;
    for (int k = 0; k < 4; ++k) {
      a.step(alone, 0.01, {0, 0, -9.81});
      b.step(shared, 0.01, {0, 0, -9.81});
    }
    EXPECT_TRUE(a.x == b.x && a.v == b.v) << products;
    EXPECT_TRUE(alone.memory().strain_impulses == shared.memory().strain_impulses);
  }
}

TEST(Substeps, MomentaOfAFreeClothAreKept) {
  const FlatCloth c = flat_cloth(2, 8);
  Substeps solver(free_map(c), c.mass, {rows_of(c, 2000), {}}, {.nets = {{0, c.n, c.n}}});
  Motion motion{disturbed(c.rest, 0.01, 5), disturbed(0 * c.rest, 0.5, 6)};
  const auto before = momenta(c.mass, motion.x, motion.v);
  for (int k = 0; k < 20; ++k) EXPECT_GT(motion.step(solver, k % 2 == 0 ? 0.02 : 0.003).iterations, 0);
  EXPECT_GT((motion.x - c.rest).norm(), 0.1);
  EXPECT_LT((momenta(c.mass, motion.x, motion.v) - before).norm(), 1e-12);
}

TEST(Substeps, PlacesAreExactAndFixedControlPointsWhereTheyShouldBe) {
  const FlatCloth c = flat_cloth(2, 8);
  const AffineMap map = moving_corners(c, {0, 0.2, 0});
  ConstraintRows rows{rows_of(c, 1000), {}};
  const auto target = [](double t) { return Eigen::Vector3d(0.37, 0.52, 0.3 * t); };
  rows.place.push_back({scalar_row(c, 0.37, 0.52, 0), 0, target});
  rows.place.push_back({scalar_row(c, 0.4, 0.58, 0), 0, [](double t) { return Eigen::Vector3d(0.4, 0.58, 0.3 * t); }});
  const ScalarRow place = rows.place[0].row;
  Substeps solver(map, map.reduce_scalar(c.mass), rows);
  Motion motion{map.restrict(c.rest), Eigen::VectorXd::Zero(3 * map.nodes())};
  Eigen::VectorXd q(c.rest.size());
  for (int k = 0; k < 10; ++k) {
    EXPECT_LT(motion.step(solver, 0.01, {0, 0, -9.81}).place_violation, 1e-14);
    map.expand(motion.x, motion.t, q);
    EXPECT_LT((apply(place, q) - target(motion.t)).norm(), 1e-14);
  }
}

TEST(Substeps, PlacesTakeUpWhatMomentumGravityGives) {
  const FlatCloth c = flat_cloth(2, 8);
  ConstraintRows rows{rows_of(c, 1000), {}};
  for (const double u : {0.3, 0.62})
    rows.place.push_back({scalar_row(c, u, 0.52, 0), 0, [u](double) { return Eigen::Vector3d(u, 0.52, 0); }});
  Substeps solver(free_map(c), c.mass, rows, {.nets = {{0, c.n, c.n}}});
  ASSERT_EQ(solver.nets(), 1);
  Motion motion{c.rest, Eigen::VectorXd::Zero(c.rest.size())};
  const Eigen::Vector3d g(1, 0, -9.81);
  Eigen::Vector3d held = Eigen::Vector3d::Zero(), momentum = held;
  for (int k = 0; k < 10; ++k) {
    motion.step(solver, 0.01, g);
    held += solver.memory().place_multipliers.rowwise().sum() / 0.01;
  }
  for (int k = 0; k < c.mass.size(); ++k) momentum += c.mass[k] * motion.v.segment<3>(3 * k);
  EXPECT_LT(held.z(), -0.05);
  EXPECT_LT((momentum - (c.mass.sum() * motion.t * g - held)).norm(), 1e-12);
}

TEST(Substeps, PlacesHeldTwiceAreRefused) {
  const FlatCloth c = flat_cloth(2, 8);
  ConstraintRows rows{rows_of(c, 1000), {}};
  for (int k = 0; k < 2; ++k)
    rows.place.push_back({scalar_row(c, 0.37, 0.52, 0), 0, [](double) { return Eigen::Vector3d(0.37, 0.52, 0); }});
  EXPECT_THROW(Substeps(free_map(c), c.mass, rows), SolverError);
}

TEST(Substeps, NumbersThatAreNoneAreNotConverged) {
  const FlatCloth c = flat_cloth(2, 6);
  Substeps solver(free_map(c), c.mass, {rows_of(c, 1000), {}});
  for (const double wrong :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e200}) {
    Motion motion{c.rest, Eigen::VectorXd::Zero(c.rest.size())};
    motion.x[17] = wrong;
    EXPECT_FALSE(motion.step(solver, 0.01).converged) << wrong;
    EXPECT_FALSE(motion.x.allFinite()) << wrong;
  }
}

// A strip drawn out by a dead load is stretched beyond the limit; its rows grow stiffer until the percentile is held,
// and the energy that this gives is told.
TEST(Substeps, RowsBeyondTheLimitGrowStifferUntilThePercentileIsHeld) {
  const FlatCloth c = flat_cloth(2, 6);
  std::vector<int> edge;
  for (int j = 0; j < c.n; ++j) edge.push_back(c.n * j);
  const AffineMap map(AffineMap::identity(c.n * c.n), edge,
                      [c, edge](std::size_t k, double) { return Eigen::Vector3d(c.rest.segment<3>(3 * edge[k])); });
  const Eigen::VectorXd mass = map.reduce_scalar(c.mass);
  Substeps solver(map, mass, {rows_of(c, 300), {}}, {.percentile = 100});
  Motion motion{map.restrict(c.rest), Eigen::VectorXd::Zero(3 * map.nodes())};
  double tightened = 0, most = 0;
  ProjectionReport report;
  for (int k = 0; k < 2000; ++k) {
    report = motion.step(solver, 0.005, {8, 0, 0});  // 8 N/m at the edge: 2.7 % at 300 N/m
    motion.v *= 0.95;
    tightened += report.tightened;
    most = std::max(most, report.strain_violation);
  }
  EXPECT_GT(most, 0.02);
  EXPECT_TRUE(report.converged);
  EXPECT_LE(report.strain_violation, 0.01);
  EXPECT_GT(report.strain_violation, 0.004) << "no stiffer than needed";
  EXPECT_GT(tightened, 0);
  EXPECT_LE(motion.forces.stiffening.maxCoeff(), 16);

  Substeps loose(map, mass, {rows_of(c, 300), {}}, {.percentile = 1});
  Motion other{map.restrict(c.rest), Eigen::VectorXd::Zero(3 * map.nodes())};
  for (int k = 0; k < 2000; ++k) {
    report = other.step(loose, 0.005, {8, 0, 0});
    other.v *= 0.95;
  }
  EXPECT_EQ(other.forces.stiffening.maxCoeff(), 1);
  EXPECT_TRUE(report.converged);
  EXPECT_LT(report.within, 0.9);
  EXPECT_GT(report.within, 0.01);
  EXPECT_EQ(report.tightened, 0);
}

// Example 4.1(a): a square metre held at two corners swings down, without drag.
struct Swing {
  ShellModel model;
  AffineMap map;
  MechanicalSystem system;
  std::unique_ptr<Substeps> solver;
  DynamicState state;
  double energy = 0, fall = 0, highest = 0;  // J; highest: of the balance

  static Fabric fabric() {
    Fabric f;
    f.drag = 0;
    return f;
  }
  explicit Swing(double stiffness, int spans = 8)
      : model([&] {
          std::vector<ClothPanel> panels;
          panels.push_back(test::make_flat_panel(1, 1, 2, spans, spans, fabric()));
          return panels;
        }()),
        map(AffineMap::identity(model.point_count()), {0, spans + 1},
            [rest = model.rest(), spans](std::size_t k, double) {
              return Eigen::Vector3d(rest.segment<3>(k == 0 ? 0 : 3 * (spans + 1)));
            }) {
    system.body = &model;
    system.potentials = model.potentials();
    system.map = &map;
    system.node_mass = map.reduce_scalar(model.lumped_mass());
    system.node_drag = map.reduce_scalar(model.lumped_drag());
    system.loads.force.resize(3 * model.point_count());
    for (int i = 0; i < model.point_count(); ++i)
      system.loads.force.segment<3>(3 * i) = model.lumped_mass()[i] * Eigen::Vector3d(0, 0, -9.81);
    std::vector<std::vector<ConstraintPoint>> points(1);
    const NurbsSurface& rest = model.panels()[0].rest;
    for (double v : rest.v().breaks())
      for (double u : rest.u().breaks()) {
        points[0].emplace_back();
        points[0].back().u = u, points[0].back().v = v;
      }
    ConstraintRows rows{strain_rows(model, map, points), {}};
    for (StrainRow& row : rows.strain) row.stiffness = stiffness * row.area;
    solver =
        std::make_unique<Substeps>(map, system.node_mass, std::move(rows),
                                   SubstepsOptions{.percentile = 1e-9, .nets = {{0, rest.count_u(), rest.count_v()}}});
    system.projection = solver.get();
    state.x = map.restrict(model.rest());
    state.v = Eigen::VectorXd::Zero(state.x.size());
    initialise(system, state);
  }
  double bound() const { return time_step_bound(model, map, system.node_mass, state.q).dt; }
  void step(double dt) {
    const StepReport report = toile::step(system, state, dt);
    ASSERT_TRUE(report.finite);
    fall += report.load_work;
    energy = report.kinetic_end + report.elastic.total() + report.limit_energy;
    highest = std::max(highest, energy - fall);
  }
  // Of the work of gravity.
  double loss() const { return (fall - energy) / fall; }
};

TEST(Substeps, AlternatingStepsHardlyChangeWhatASwingLoses) {
  Swing even(11700), uneven(11700);
  const double bound = even.bound();
  for (int k = 0; k < 1000 && even.state.t < 0.55; ++k) even.step(0.6 * bound);
  for (int k = 0; k < 2000 && uneven.state.t < 0.55; ++k) uneven.step((k % 2 == 0 ? 0.6 : 0.06) * bound);
  EXPECT_GT(even.fall, 0.4);
  EXPECT_LT(std::abs(even.loss()), 2e-3);
  EXPECT_LT(std::abs(even.loss() - uneven.loss()), 1e-3);
  EXPECT_LT(even.highest, 1e-3 * even.fall) << "energy from nowhere";
  EXPECT_LT(uneven.highest, 1e-3 * uneven.fall);
}

TEST(Substeps, IsOfSecondOrderInTheStep) {
  const auto end = [](double dt, double stiffness) {
    Swing swing(stiffness, 5);
    for (int k = 0; k < std::lround(0.16 / dt); ++k) swing.step(dt);
    return swing.state.x;
  };
  for (const auto& [stiffness, dt] : {std::pair(20.0, 2e-3), std::pair(1170.0, 5e-4), std::pair(11700.0, 2.5e-4)}) {
    const Eigen::VectorXd exact = end(dt / 16, stiffness);
    const double coarse = (end(dt, stiffness) - exact).norm(), fine = (end(dt / 4, stiffness) - exact).norm();
    EXPECT_GT(coarse / fine, 12) << stiffness << ": " << coarse << ", " << fine;
    // Steps of many substeps.
    EXPECT_LT((end(4e-3, stiffness) - exact).norm(), 1e-3) << stiffness;
  }
}

}  // namespace
}  // namespace toile
