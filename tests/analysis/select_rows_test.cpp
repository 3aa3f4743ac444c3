// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/constraint/select_rows.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "analysis/constraint/point_rule.h"
#include "analysis/map/extension.h"
#include "analysis/projection/fast_projection.h"
#include "geometry/basis.h"
#include "geometry/error.h"
#include "support/near.h"
#include "support/panels.h"
#include "trimming/constraint_points.h"
#include "trimming/loops.h"

namespace toile {
namespace {

// A cloth with bending stiffness of weft and warp alike and linear but for a millionth of the curvatures at hand.
Fabric stiff_fabric() {
  Fabric fabric;
  fabric.bending = {.b0 = 1e-3, .kappa0 = 1e-6, .kappa_reg = 1e-9};
  return fabric;
}

// A strip (width x height, centred on the origin, weft along x) as a trim in a square patch turned by `angle`.
struct Strip {
  ClothPanel panel;
  std::vector<std::vector<ConstraintPoint>> points;
  Extension extension;
};
Strip finish(TrimmedSurface surface, double grain, PointRule rule) {
  validate_loops(surface);
  const TrimTopology topology = trace_trims(surface);
  Strip strip;
  strip.panel = {"strip", surface.surface, quadrature(surface, topology), stiff_fabric(), grain};
  strip.points = {constraint_points(surface, topology)};
  apply_rule(rule, surface, topology, strip.points[0]);
  std::vector<ClothPanel> panels{strip.panel};
  strip.extension = extend(strip.panel.rest, strip.panel.quadrature, ShellModel(std::move(panels)).lumped_mass());
  strip.panel.rest = strip.extension.rest;
  return strip;
}
Strip fitted_strip(double width, double height, double cell) {
  const NurbsSurface flat = test::flat_surface(width, height, uniform_knots(2, int(std::lround(width / cell))),
                                               uniform_knots(2, int(std::lround(height / cell))));
  return finish(untrimmed(flat.with_points(flat.points().colwise() - Eigen::Vector3d(width / 2, height / 2, 0))), 0,
                PointRule::knot_mesh);
}
Strip trimmed_strip(double width, double height, double cell, double angle, PointRule rule = PointRule::knot_mesh) {
  const double half = std::ceil(0.55 * std::hypot(width, height) / cell) * cell;
  const int spans = int(std::lround(2 * half / cell));
  const NurbsSurface flat = test::flat_surface(2 * half, 2 * half, uniform_knots(2, spans, {-half, half}),
                                               uniform_knots(2, spans, {-half, half}));
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  TrimmedSurface surface;
  surface.surface = flat.with_points(turn * (flat.points().colwise() - Eigen::Vector3d(half, half, 0)));
  const Eigen::Rotation2Dd back(-angle);
  const Eigen::Vector2d corners[] = {
      {-width / 2, -height / 2}, {width / 2, -height / 2}, {width / 2, height / 2}, {-width / 2, height / 2}};
  TrimLoop loop;
  for (int k = 0; k < 4; ++k) {
    TrimCurve curve{line_segment<2>(back * corners[k], back * corners[(k + 1) % 4]), k, false, {}};
    loop.curves.push_back(curve);
  }
  surface.loops = {loop};
  return finish(surface, -angle, rule);
}

// The net of the surface that meets f at all Greville points: column k of f belongs to control point k.
Eigen::Matrix3Xd interpolate(const NurbsSurface& surface, const Eigen::Matrix3Xd& f) {
  const auto collocation = [](const KnotVector& knots) {
    const int n = knots.control_point_count();
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n, n);
    for (int i = 0; i < n; ++i) {
      const BasisValues b = evaluate_basis(knots, knots.greville(i), 0);
      for (int a = 0; a <= b.degree; ++a) m(i, b.first + a) = b.value[0][a];
    }
    return m;
  };
  const auto u = collocation(surface.u()).partialPivLu(), v = collocation(surface.v()).partialPivLu();
  Eigen::Matrix3Xd net(3, f.cols());
  for (int a = 0; a < 3; ++a) {
    const Eigen::VectorXd row = f.row(a);
    const Eigen::Map<const Eigen::MatrixXd> values(row.data(), surface.count_u(), surface.count_v());
    const Eigen::MatrixXd half = u.solve(values).transpose();
    const Eigen::MatrixXd full = v.solve(half).transpose();
    net.row(a) = Eigen::Map<const Eigen::RowVectorXd>(full.data(), full.size());
  }
  return net;
}

struct Rolled {
  double bending = 0, violation = 0, expected = 0;
  bool converged = false;
  int iterations = 0;
};

// Bending energy of the strip on a cylinder of the given radius about y, after its rows are met to a tenth of the usual
// limit.
Rolled roll(Strip strip, double radius) {
  std::vector<ClothPanel> panels{strip.panel};
  const ShellModel model(std::move(panels));
  const AffineMap map(strip.extension.dependence, {}, nullptr);
  const Eigen::VectorXd mass = map.reduce_scalar(model.lumped_mass());
  const std::vector<StrainRow> rows = select_rows(model, map, strip.points, {});
  FastProjection projection(map, mass, {rows, {}}, {.tolerance = 1e-3});
  const NurbsSurface& rest = model.panels()[0].rest;
  Eigen::Matrix3Xd places(3, rest.points().cols());
  for (int k = 0; k < places.cols(); ++k) {
    const Eigen::Vector3d x = rest(rest.u().greville(k % rest.count_u()), rest.v().greville(k / rest.count_u()));
    places.col(k) << radius * std::sin(x[0] / radius), x[1], radius * (1 - std::cos(x[0] / radius));
  }
  Eigen::VectorXd q = interpolate(rest, places).reshaped(), force(q.size());
  Eigen::VectorXd x = map.restrict(q);
  const ProjectionReport report = projection.project(x, 0);
  map.expand(x, 0, q);
  Rolled out;
  out.bending = model.internal_force(q, force).bending;
  out.converged = report.converged;
  out.violation = report.strain_violation;
  out.iterations = report.iterations;
  out.expected = 0.5 * 1e-3 / (radius * radius) * model.lumped_mass().sum() / stiff_fabric().density;
  return out;
}

TEST(SelectRows, TrimmedStripRolledIntoACylinderBendsLikeTheFittedOne) {
  const Rolled fitted = roll(fitted_strip(1, 0.25, 0.05), 0.35);
  EXPECT_TRUE(fitted.converged);
  expect_near_rel(fitted.bending, fitted.expected, 0.02);
  for (double angle : {0.1, 0.3, 0.7}) {
    const Rolled trimmed = roll(trimmed_strip(1, 0.25, 0.05, angle), 0.35);
    EXPECT_TRUE(trimmed.converged) << trimmed.violation;
    EXPECT_LE(trimmed.iterations, 5);
    expect_near_rel(trimmed.bending, fitted.bending, 0.02);
    // With rows at the corners, which hard rows beside them nearly hold already.
    const Rolled cornered = roll(trimmed_strip(1, 0.25, 0.05, angle, PointRule::greville_derivative), 0.35);
    EXPECT_TRUE(cornered.converged) << cornered.violation;
    expect_near_rel(cornered.bending, fitted.bending, 0.02);
  }
}

TEST(SelectRows, TakesEveryPointThatCanMove) {
  Strip strip = trimmed_strip(1, 0.25, 0.05, 0.3, PointRule::greville_derivative);
  std::vector<ClothPanel> panels{strip.panel};
  const ShellModel model(std::move(panels));
  const AffineMap map(strip.extension.dependence, {}, nullptr);
  const auto rows = select_rows(model, map, strip.points, {});
  std::size_t used = 0;
  for (const ConstraintPoint& point : strip.points[0]) {
    EXPECT_EQ(point.used, point.why.empty());
    EXPECT_TRUE(point.used || point.why == "merged") << point.why;
    used += point.used;
  }
  EXPECT_EQ(rows.size(), 2 * used);
}

TEST(SelectRows, RowsShareTheAreaOfTheCloth) {
  for (Strip strip : {fitted_strip(1, 0.25, 0.05), trimmed_strip(1, 0.25, 0.05, 0.3)}) {
    std::vector<ClothPanel> panels{strip.panel};
    const ShellModel model(std::move(panels));
    const AffineMap map(strip.extension.dependence, {}, nullptr);
    double weft = 0, warp = 0;
    for (const StrainRow& row : select_rows(model, map, strip.points, {})) (row.warp ? warp : weft) += row.area;
    expect_near_rel(weft, 0.25, 1e-6);
    expect_near_rel(warp, 0.25, 1e-6);
  }
}

TEST(SelectRows, PointsOnFixedControlPointsOnlyAreLeftOut) {
  Strip strip = fitted_strip(1, 0.25, 0.05);
  std::vector<ClothPanel> panels{strip.panel};
  const ShellModel model(std::move(panels));
  std::vector<int> edge;
  const int n = strip.panel.rest.count_u();
  for (int k = 0; k < 2 * n; ++k) edge.push_back(k);  // two rows: a clamp
  const AffineMap map(AffineMap::identity(model.point_count()), edge,
                      [&](std::size_t k, double) { return Eigen::Vector3d(model.rest().segment<3>(3 * edge[k])); });
  const auto rows = select_rows(model, map, strip.points, {});
  for (const ConstraintPoint& point : strip.points[0]) {
    EXPECT_EQ(point.used, point.v > 0);
    EXPECT_EQ(point.why, point.v > 0 ? "" : "fixed");
  }
  for (const StrainRow& row : rows) EXPECT_GT(strip.points[0][row.point].v, 0);
}

TEST(SelectRows, NearPointsAreMergedAndVerticesWin) {
  Strip strip = fitted_strip(1, 0.25, 0.05);
  auto& points = strip.points[0];
  const ConstraintPoint vertex = points[30];
  ConstraintPoint near = vertex;
  near.kind = PointKind::crossing_u;
  near.v += 0.04 / 5;  // in a domain of five cells
  points.insert(points.begin(), near);
  std::vector<ClothPanel> panels{strip.panel};
  const ShellModel model(std::move(panels));
  const AffineMap map(AffineMap::identity(model.point_count()), {}, nullptr);
  select_rows(model, map, strip.points, {});
  EXPECT_FALSE(points[0].used);
  EXPECT_EQ(points[0].why, "merged");
  EXPECT_TRUE(points[31].used);
}

TEST(SelectRows, PinsThatContradictEachOtherAreNamed) {
  Strip strip = fitted_strip(1, 0.25, 0.05);
  std::vector<ClothPanel> panels{strip.panel};
  const ShellModel model(std::move(panels));
  const AffineMap map(AffineMap::identity(model.point_count()), {}, nullptr);
  const auto pin = [&](int number, double u, double v, double z) {
    const Eigen::Vector3d place(0, 0, z);
    return PlaceRow{model.place(0, u, v), number, [place](double) { return place; }};
  };
  // Pins that agree, or hold different places, cost no strain row.
  const std::size_t rows = select_rows(model, map, strip.points, {}).size();
  EXPECT_GT(rows, 0u);
  EXPECT_EQ(select_rows(model, map, strip.points, {pin(4, 0.3, 0.5, 0), pin(7, 0.3, 0.5, 0)}).size(), rows);
  EXPECT_EQ(select_rows(model, map, strip.points, {pin(4, 0.3, 0.5, 0), pin(7, 0.6, 0.5, 1)}).size(), rows);
  try {
    select_rows(model, map, strip.points, {pin(2, 0.9, 0.5, 0), pin(4, 0.3, 0.5, 0), pin(7, 0.3, 0.5, 0.1)});
    FAIL() << "accepted";
  } catch (const SolverError& error) {
    EXPECT_NE(std::string(error.what()).find("pin 4 and pin 7"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace toile
