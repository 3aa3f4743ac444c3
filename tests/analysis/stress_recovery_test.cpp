// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/constraint/stress_recovery.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "analysis/constraint/point_rule.h"
#include "analysis/constraint/row_areas.h"
#include "analysis/constraint/select_rows.h"
#include "analysis/map/extension.h"
#include "support/near.h"
#include "support/panels.h"
#include "trimming/loops.h"

namespace toile {
namespace {

TrimmedSurface square(int degree, int spans) {
  return untrimmed(test::flat_surface(1, 1, uniform_knots(degree, spans), uniform_knots(degree, spans)));
}

struct Limited {
  ShellModel model;
  ConstraintRows rows;
};
Limited limited(const TrimmedSurface& face, PointRule rule = PointRule::greville_derivative) {
  const TrimTopology topology = trace_trims(face);
  std::vector<ClothPanel> panels{test::make_panel(face.surface)};
  panels[0].quadrature = quadrature(face, topology);
  ShellModel model(std::move(panels));
  std::vector<std::vector<ConstraintPoint>> points{constraint_points(face, topology)};
  const std::vector<ConstraintPoint> extra = apply_rule(rule, face, topology, points[0]);
  points[0].insert(points[0].end(), extra.begin(), extra.end());
  const AffineMap map(AffineMap::identity(model.point_count()), {}, nullptr);
  std::vector<StrainRow> rows = select_rows(model, map, points, {});
  return {std::move(model), {std::move(rows), {}}};
}

// Largest part of a uniform stress's force on a control point, over the largest force, that the rows' areas leave over.
double unbalanced(const Limited& l, bool warp) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(l.model.point_count()), whole = sum;
  for (const StrainRow& row : l.rows.strain)
    for (std::size_t k = 0; row.warp == warp && k < row.row.index.size(); ++k)
      sum[row.row.index[k]] += row.area * row.row.value[k];
  const ClothPanel& panel = l.model.panels()[0];
  for (std::size_t p = 0; p < panel.quadrature.points.size(); ++p) {
    const Eigen::Vector2d& uv = panel.quadrature.points[p];
    const MaterialPoint point = l.model.material_point(0, uv.x(), uv.y());
    for (std::size_t k = 0; k < point.index.size(); ++k)
      whole[point.index[k]] += panel.quadrature.weights[p] * point.value[warp ? 2 : 1][k];
  }
  return (sum - whole).cwiseAbs().maxCoeff() / whole.cwiseAbs().maxCoeff();
}

TEST(RowAreas, AUniformStressIsInEquilibrium) {
  for (const int degree : {2, 3, 4, 5}) {
    // As many lines as Simpson's rule takes: an odd number.
    const int spans = degree % 2 == 0 ? 8 : 7;
    const Limited l = limited(square(degree, spans));
    for (const bool warp : {false, true}) EXPECT_LT(unbalanced(l, warp), 1e-3) << degree;
    double area = 0;
    for (const StrainRow& row : l.rows.strain) area += row.warp ? 0 : row.area;
    expect_near_rel(area, 1, 1e-3);
  }
}

// A cut cell's corner, which no knot line meets, has a row of its own; bounds on the areas are part of the least
// squares.
TEST(RowAreas, AUniformStressIsNearlyInEquilibriumOnTurnedNetsAndExactlyOnAlignedOnes) {
  for (const int degrees : {0, 15, 30, 45})
    for (const int spans : {10, 20}) {
      const double angle = degrees * std::numbers::pi / 180, size = degrees == 0 ? 1.2 : 1.6;
      TrimmedSurface face = test::turned_square(2, spans, size, angle);
      validate_loops(face);
      const TrimTopology topology = trace_trims(face);
      std::vector<ClothPanel> panels{test::make_panel(face.surface, {}, -angle)};
      panels[0].quadrature = quadrature(face, topology);
      const Extension extension = extend(face.surface, panels[0].quadrature, ShellModel(panels).lumped_mass());
      panels[0].rest = extension.rest;
      const ShellModel model(panels);
      const AffineMap map(extension.dependence, {}, nullptr);
      std::vector<std::vector<ConstraintPoint>> points{constraint_points(face, topology)};
      ASSERT_TRUE(apply_rule(PointRule::greville_derivative, face, topology, points[0]).empty());
      const std::vector<StrainRow> rows = select_rows(model, map, points, {});
      const Eigen::Vector2d left = unbalanced_part(model, map, rows);
      EXPECT_LT(left.maxCoeff(), degrees == 0 ? 1e-6 : 0.1) << degrees << ' ' << spans;
      for (const bool warp : {false, true}) {
        double area = 0;
        for (const StrainRow& row : rows) area += row.warp == warp ? row.area : 0;
        expect_near_rel(area, 1, 1e-12);
      }
    }
}

TEST(RowAreas, TrapezoidAlongTheThreadsAndSimpsonAcross) {
  const Limited l = limited(square(2, 8));
  for (const StrainRow& row : l.rows.strain) {
    const double along = row.warp ? row.uv.y() : row.uv.x(), across = row.warp ? row.uv.x() : row.uv.y();
    const int line = int(std::lround(8 * across));
    const bool ends_along = along == 0 || along == 1, ends_across = line == 0 || line == 8;
    const double expected = (ends_along ? 0.5 : 1) * (ends_across ? 1.0 / 3 : line % 2 ? 4.0 / 3 : 2.0 / 3) / 64;
    expect_near_rel(row.area, expected, 2e-3);
  }
}

// The multipliers that hard rows have in a cloth under one uniform stress: Simpson's weights across the pull, which
// the paper's nodal areas turn into stripes of 2/3 and 4/3.
TEST(StressRecovery, TheStripesOfTheMultipliersAreGone) {
  const Limited l = limited(square(2, 8));
  Eigen::VectorXd force = Eigen::VectorXd::Zero(l.rows.strain.size());
  double least = 1, most = 0;
  for (std::size_t r = 0; r < l.rows.strain.size(); ++r) {
    const StrainRow& row = l.rows.strain[r];
    if (!row.warp) continue;
    const int i = int(std::lround(8 * row.uv.x())), j = int(std::lround(8 * row.uv.y()));
    const double across = i % 8 == 0 ? 1.0 / 3 : i % 2 ? 4.0 / 3 : 2.0 / 3, along = j % 8 == 0 ? 0.5 : 1;
    force[Eigen::Index(r)] = across * along / 64;
    if (i % 8 == 0 || j % 8 == 0) continue;
    least = std::min(least, force[Eigen::Index(r)] * 64);
    most = std::max(most, force[Eigen::Index(r)] * 64);
  }
  EXPECT_LT(least, 0.7);  // over a cell's area
  EXPECT_GT(most, 1.3);
  const Eigen::VectorXd& rest = l.model.rest();
  const std::vector<ThreadStress> raw = row_stress(l.model, l.rows, force, rest);
  for (std::size_t r = 0; r < raw.size(); ++r) EXPECT_NEAR(raw[r].nominal, l.rows.strain[r].warp ? 1 : 0, 2e-3);
  Eigen::Matrix3Xd pull = Eigen::Matrix3Xd::Zero(3, force.size());
  pull.row(1) = force.transpose();
  const AffineMap map(AffineMap::identity(l.model.point_count()), {}, nullptr);
  const StressField field(l.model, map, l.rows, pull, rest);
  for (const double u : {0.0, 0.03, 0.31, 0.5, 0.77, 1.0})
    for (const double v : {0.0, 0.12, 0.5, 0.93, 1.0}) {
      const auto [weft, warp] = field.at(0, u, v);
      EXPECT_NEAR(warp.nominal, 1, 1e-6);
      EXPECT_NEAR(warp.second_pk, 1, 1e-6);
      EXPECT_NEAR(weft.nominal, 0, 1e-6);
    }
}

TEST(StressRecovery, TheFabricsPartIsInIt) {
  const Limited l = limited(square(3, 5));
  Eigen::VectorXd q = l.model.rest();
  for (int k = 0; k < q.size(); k += 3) q[k] *= 1.1;
  const AffineMap map(AffineMap::identity(l.model.point_count()), {}, nullptr);
  const StressField field(l.model, map, {}, Eigen::Matrix3Xd(3, 0), q);
  const double S = l.model.panels()[0].fabric.membrane.weft * 0.5 * (1.1 * 1.1 - 1);
  const auto [weft, warp] = field.at(0, 0.4, 0.7);
  expect_near_rel(weft.second_pk, S, 1e-6);
  expect_near_rel(weft.nominal, 1.1 * S, 1e-6);
  EXPECT_NEAR(warp.nominal, 0, 1e-6);
  EXPECT_NEAR(field.second_pk(0, 0.4, 0.7)[2], 0, 1e-6);
}

TEST(StressRecovery, WhatPinsTakeUpDoesNotCount) {
  const Limited l = limited(square(2, 8));
  Eigen::VectorXd q = l.model.rest();
  for (int i = 0; i < l.model.point_count(); ++i) {
    const double x = q[3 * i], y = q[3 * i + 1];
    q[3 * i] += 0.02 * x + 0.01 * x * y;
    q[3 * i + 1] += 0.03 * y;
  }
  const AffineMap map(AffineMap::identity(l.model.point_count()), {0, 1}, [&](std::size_t k, double) {
    return Eigen::Vector3d(q.segment<3>(3 * static_cast<Eigen::Index>(k)));
  });
  ConstraintRows rows;
  const ScalarRow pinned = l.model.place(0, 0.55, 0.62);
  rows.place.push_back({pinned, 0, [&](double) { return apply(pinned, q); }});
  // A strain row that acts on what is held only, and one whose force the pin takes up.
  rows.strain.push_back({{{0, 1}, {-1, 1}}, 0, 0, false, 1, 1, {0.05, 0}, {1, 0}});
  rows.strain.push_back({pinned, 0, 0, true, 1, 1, {0.55, 0.62}, {0, 1}});
  const StressField::Options by_forces{.rows = 0};
  const StressField still(l.model, map, rows, Eigen::Matrix3Xd::Zero(3, 2), q, by_forces);
  Eigen::Matrix3Xd forces(3, 2);  // across the rows' own directions, so that they are no stress of the limit
  forces.col(0) = 7 * apply(rows.strain[0].row, q).cross(Eigen::Vector3d(0, 1, 2));
  forces.col(1) = 5 * apply(rows.strain[1].row, q).cross(Eigen::Vector3d(1, 1, -2));
  const StressField pulled(l.model, map, rows, forces, q, by_forces);
  for (const double u : {0.0, 0.3, 0.6, 1.0})
    for (const double v : {0.0, 0.5, 0.65, 1.0}) {
      const Eigen::Vector3d s = pulled.second_pk(0, u, v), own = l.model.state(0, u, v, q).second_pk;
      EXPECT_LT((s - still.second_pk(0, u, v)).norm(), 0.02);
      EXPECT_LT((still.second_pk(0, u, v) - own).norm(), 0.02);
    }
}

// A force in the plane of flat cloth, at a pin there: it is stress unless the pin holds it.
TEST(StressRecovery, PinsThatHoldSomeAxesTakeUpForcesAlongTheseAlone) {
  const Limited l = limited(square(2, 8));
  const Eigen::VectorXd& q = l.model.rest();
  const AffineMap map(AffineMap::identity(l.model.point_count()), {0, 1}, [&](std::size_t k, double) {
    return Eigen::Vector3d(q.segment<3>(3 * static_cast<Eigen::Index>(k)));
  });
  const ScalarRow spot = l.model.place(0, 0.55, 0.62);
  const auto stress = [&](const std::vector<Eigen::Vector3d>& pins, const Eigen::Vector3d& force) {
    ConstraintRows rows;
    rows.strain.push_back({spot, 0, 0, true, 1, 1, {0.55, 0.62}, {0, 1}});
    for (const Eigen::Vector3d& axes : pins)
      rows.place.push_back({spot, 0, [&](double) { return apply(spot, q); }, axes});
    const StressField field(l.model, map, rows, force, q, {.rows = 0});
    Eigen::Matrix3Xd out(3, 0);
    for (const double u : {0.0, 0.3, 0.6, 1.0})
      for (const double v : {0.0, 0.5, 0.65, 1.0}) {
        out.conservativeResize(3, out.cols() + 1);
        out.rightCols(1) = field.second_pk(0, u, v);
      }
    return out;
  };
  const Eigen::Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  const Eigen::Matrix3Xd unheld = stress({}, x);
  const double size = unheld.norm();
  ASSERT_GT(size, 1);
  EXPECT_LT((stress({z}, x) - unheld).norm(), 1e-6 * size);
  EXPECT_LT(stress({x}, x).norm(), 0.01 * size);
  EXPECT_LT((stress({x, y, z}, x + y) - stress({Eigen::Vector3d::Ones()}, x + y)).norm(), 1e-6 * size);
}

}  // namespace
}  // namespace toile
