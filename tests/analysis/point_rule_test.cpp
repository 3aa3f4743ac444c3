// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/constraint/point_rule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "analysis/constraint/select_rows.h"
#include "analysis/projection/fast_projection.h"
#include "analysis/scheme/time_step.h"
#include "analysis/scheme/verlet.h"
#include "geometry/refine.h"
#include "support/panels.h"

namespace toile {
namespace {

TrimmedSurface square(int degree, int spans) {
  return untrimmed(test::flat_surface(1, 1, uniform_knots(degree, spans), uniform_knots(degree, spans)));
}

struct Swing {
  Eigen::Vector3d corner;
  double largest = 0;  // |E11|, |E22| on a 50 x 50 grid
};

// Example 4.1(a) from rest until 0.6 s.
Swing swing(const TrimmedSurface& face, PointRule rule) {
  const TrimTopology topology = trace_trims(face);
  std::vector<std::vector<ConstraintPoint>> points{constraint_points(face, topology)};
  const std::vector<ConstraintPoint> extra = apply_rule(rule, face, topology, points[0]);
  points[0].insert(points[0].end(), extra.begin(), extra.end());
  ClothPanel panel = test::make_panel(face.surface);
  panel.kinks = kink_points(face, topology);
  const ShellModel model({panel});
  const Eigen::VectorXd rest = model.rest();
  const std::vector<int> corners{0, face.surface.count_u() - 1};
  const AffineMap map(AffineMap::identity(model.point_count()), corners,
                      [&](std::size_t k, double) { return Eigen::Vector3d(rest.segment<3>(3 * corners[k])); });
  MechanicalSystem system;
  system.body = &model;
  system.potentials = model.potentials();
  system.map = &map;
  system.node_mass = map.reduce_scalar(model.lumped_mass());
  system.node_drag = map.reduce_scalar(model.lumped_drag());
  system.loads.force.resize(rest.size());
  for (int i = 0; i < model.point_count(); ++i)
    system.loads.force.segment<3>(3 * i) << 0, 0, -9.81 * model.lumped_mass()[i];
  std::vector<StrainRow> rows = select_rows(model, map, points, {});
  for (StrainRow& row : rows) row.stiffness = 1170 * row.area;  // k / rho = 1e4 m2/s2
  FastProjection projection(map, system.node_mass, {rows, {}});
  system.projection = &projection;
  DynamicState state;
  state.x = map.restrict(rest);
  state.v = Eigen::VectorXd::Zero(state.x.size());
  initialise(system, state);
  constexpr double dt = 5e-4;
  EXPECT_LT(dt, time_step_bound(model, map, system.node_mass, rest).dt);
  for (int k = 0; k < 1200; ++k) EXPECT_TRUE(step(system, state, dt).projection.converged);

  Eigen::VectorXd q(rest.size());
  map.expand(state.x, state.t, q);
  Swing out{model.state(0, 1, 1, q).position};
  for (int j = 0; j < 50; ++j)
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d strain = model.state(0, (i + 0.5) / 50, (j + 0.5) / 50, q).strain;
      out.largest = std::max(out.largest, strain.head<2>().cwiseAbs().maxCoeff());
    }
  return out;
}

TEST(PointRule, ClothOfHigherDegreeSwingsLikeQuadraticClothAndKeepsItsLengthBetweenThePoints) {
  constexpr PointRule rule = PointRule::greville_derivative;
  const Swing quadratic = swing(square(2, 8), rule);
  for (const int degree : {3, 4}) {
    const Swing other = swing(square(degree, 10 - degree), rule);
    // As many control points on 8, 7 and 6 spans: no two of these meshes are alike.
    EXPECT_LT((other.corner - quadratic.corner).norm(), 0.015) << degree;
    EXPECT_LT(other.largest, 0.01) << degree;
  }
  // What the rule is for: with the knot mesh alone the border stretches by a tenth and the corner runs ahead.
  const Swing knot_mesh = swing(square(3, 7), PointRule::knot_mesh);
  EXPECT_GT(knot_mesh.largest, 0.05);
  EXPECT_GT((knot_mesh.corner - quadratic.corner).norm(), 0.015);
}

struct Lines {
  std::set<double> u, v;
  std::size_t points = 0;
};
Lines lines_of(PointRule rule, const TrimmedSurface& face) {
  const TrimTopology topology = trace_trims(face);
  std::vector<ConstraintPoint> points = constraint_points(face, topology);
  const std::vector<ConstraintPoint> extra = apply_rule(rule, face, topology, points);
  points.insert(points.end(), extra.begin(), extra.end());
  Lines lines;
  for (const ConstraintPoint& point : points) {
    if (!point.used) continue;
    lines.u.insert(point.u);
    lines.v.insert(point.v);
    ++lines.points;
  }
  return lines;
}

TEST(PointRule, LinesAreAsManyAsTheRuleSays) {
  for (const int degree : {2, 3, 4, 5})
    for (const int spans : {1, 2, 7}) {
      const TrimmedSurface face = square(degree, spans);
      const std::size_t n = spans + degree, m = spans;
      const auto expect = [&](PointRule rule, std::size_t lines, std::size_t points) {
        const Lines found = lines_of(rule, face);
        EXPECT_EQ(found.u.size(), lines) << static_cast<int>(rule) << ' ' << degree << ' ' << spans;
        EXPECT_EQ(found.v.size(), lines);
        EXPECT_EQ(found.points, points);
      };
      expect(PointRule::knot_mesh, m + 1, (m + 1) * (m + 1));
      expect(PointRule::border, degree == 2 ? m + 1 : n, degree == 2 ? (m + 1) * (m + 1) : n * n);
      expect(PointRule::mid_span, 2 * m + 1, (m + 1) * (m + 1) + m * m);
      expect(PointRule::half_span, 2 * m + 1, (2 * m + 1) * (2 * m + 1));
      expect(PointRule::greville, n, n * n);
      expect(PointRule::greville_derivative, n - 1, (n - 1) * (n - 1));
      expect(PointRule::gauss_1, m, m * m);
      expect(PointRule::gauss_2x2, 2 * m, 4 * m * m);
      expect(PointRule::cell_average, 0, 0);
      expect(PointRule::springs_quad, 0, 0);
    }
}

TEST(PointRule, LinesLieInTheDomainWhateverTheDegree) {
  for (int degree = 1; degree <= 5; ++degree)
    for (const bool closed : {false, true})
      for (const NamedRule& named : point_rules()) {
        const TrimmedSurface face = square(degree, 3);
        const TrimTopology topology = trace_trims(face);
        std::vector<ConstraintPoint> points = constraint_points(face, topology);
        for (const ConstraintPoint& p : apply_rule(named.rule, face, topology, points, {closed, false})) {
          EXPECT_TRUE(face.surface.u().domain().contains(p.u) && face.surface.v().domain().contains(p.v))
              << named.name << ' ' << degree << ": " << p.u << ", " << p.v;
        }
      }
  // At degree 1 the tangents are constant on each span: its middle stands for it.
  const Lines flat = lines_of(PointRule::greville_derivative, square(1, 4));
  EXPECT_EQ(flat.u.size(), 4u);
  EXPECT_NEAR(*flat.u.begin(), 0.125, 1e-15);
}

TEST(PointRule, SmoothQuadraticPanelsTakeTheKnotMesh) {
  const TrimmedSurface face = square(2, 5);
  const TrimTopology topology = trace_trims(face);
  for (const PointRule rule : {PointRule::border, PointRule::greville_derivative}) {
    std::vector<ConstraintPoint> points = constraint_points(face, topology);
    EXPECT_TRUE(apply_rule(rule, face, topology, points).empty());
    for (const ConstraintPoint& point : points) EXPECT_TRUE(point.used);
  }
}

TEST(PointRule, GaussPointsIntegrateTheirCell) {
  // Two points per direction at 1/2 -+ 1/sqrt(12): exact for cubics.
  std::vector<double> u;
  for (const double x : lines_of(PointRule::gauss_2x2, square(2, 1)).u) u.push_back(x);
  ASSERT_EQ(u.size(), 2u);
  EXPECT_NEAR(0.5 * (std::pow(u[0], 3) + std::pow(u[1], 3)), 0.25, 1e-15);
  EXPECT_NEAR(0.5 * (u[0] + u[1]), 0.5, 1e-15);
}

TEST(PointRule, AFoldedQuadraticClothKeepsItsLengthBesideTheFold) {
  const std::vector<double> fold{0.5};
  const TrimmedSurface face =
      untrimmed(insert_knots(insert_knots(square(2, 8).surface, Direction::u, fold), Direction::v, fold));
  const Swing smooth = swing(square(2, 8), PointRule::knot_mesh);
  for (const PointRule rule : {PointRule::border, PointRule::greville_derivative}) {
    const Swing folded = swing(face, rule);
    EXPECT_LT(folded.largest, 0.01);
    EXPECT_LT((folded.corner - smooth.corner).norm(), 0.020);
  }
  EXPECT_GT(swing(face, PointRule::knot_mesh).largest, 0.05);
}

TEST(PointRule, PointsLieInTheMaterial) {
  TrimmedSurface face = square(3, 5);
  TrimLoop loop;
  const Eigen::Vector2d corners[] = {{0.03, 0.02}, {0.98, 0.11}, {0.52, 0.97}};
  for (int k = 0; k < 3; ++k) loop.curves.push_back({line_segment<2>(corners[k], corners[(k + 1) % 3]), k, false, {}});
  face.loops = {loop};
  face.natural_bounds = false;
  const TrimTopology topology = trace_trims(face);
  for (const NamedRule& named : point_rules()) {
    std::vector<ConstraintPoint> listed = constraint_points(face, topology);
    const std::vector<ConstraintPoint> points = apply_rule(named.rule, face, topology, listed);
    for (const ConstraintPoint& point : points)
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector2d along = corners[(k + 1) % 3] - corners[k];
        const Eigen::Vector2d to = Eigen::Vector2d(point.u, point.v) - corners[k];
        EXPECT_GE(along.x() * to.y() - along.y() * to.x(), -1e-12) << point.u << ' ' << point.v;
      }
    // Trims are held by the rules on the knot mesh and by the default; others leave them alone.
    const bool at_trims = std::ranges::any_of(
        listed, [](const ConstraintPoint& point) { return point.used && point.kind != PointKind::vertex; });
    const bool expected = named.rule == PointRule::knot_mesh || named.rule == PointRule::border ||
                          named.rule == PointRule::mid_span || named.rule == PointRule::half_span ||
                          named.rule == PointRule::greville_derivative;
    EXPECT_EQ(at_trims, expected) << named.name;
    if (named.rule == PointRule::greville_derivative) {
      EXPECT_GT(points.size(), 0u);
    }
  }
}

TEST(PointRule, ATrimAlongTheDomainsBorderChangesNothing) {
  TrimmedSurface face = square(3, 5);
  const Lines open = lines_of(PointRule::greville_derivative, face);
  face.natural_bounds = false;
  const Lines trimmed = lines_of(PointRule::greville_derivative, face);
  EXPECT_EQ(open.u, trimmed.u);
  EXPECT_EQ(open.points, trimmed.points);
}

TEST(PointRule, NamesAreDistinctAndFound) {
  std::set<std::string_view> names;
  for (const NamedRule& named : point_rules()) {
    names.insert(named.name);
    EXPECT_EQ(point_rule(named.name), named.rule);
  }
  EXPECT_EQ(names.size(), point_rules().size());
  EXPECT_FALSE(point_rule("knot mesh"));
}

}  // namespace
}  // namespace toile
