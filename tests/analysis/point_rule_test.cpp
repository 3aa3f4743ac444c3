#include "analysis/projection/point_rule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "analysis/dynamics/time_step.h"
#include "analysis/dynamics/verlet.h"
#include "analysis/projection/fast_projection.h"
#include "analysis/projection/select_rows.h"
#include "geometry/refine.h"
#include "support/panels.h"

namespace toile {
namespace {

TrimmedSurface untrimmed(NurbsSurface surface) {
  TrimmedSurface face;
  face.surface = std::move(surface);
  face.loops = {natural_loop(face.surface)};
  face.natural_bounds = true;
  return face;
}

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
  const std::vector<ConstraintPoint> extra = points_for_degree(face, topology, rule);
  points[0].insert(points[0].end(), extra.begin(), extra.end());
  ShellPanel panel = test::make_panel(face.surface);
  panel.kinks = kink_points(face, topology);
  const ShellModel model({panel});
  const Eigen::VectorXd rest = model.rest();
  const std::vector<int> corners{0, face.surface.count_u() - 1};
  const AffineMap map(AffineMap::identity(model.control_point_count()), corners,
                      [&](std::size_t k, double) { return Eigen::Vector3d(rest.segment<3>(3 * corners[k])); });
  DynamicSystem system;
  system.model = &model;
  system.map = &map;
  system.node_mass = map.reduce_scalar(model.lumped_mass());
  system.node_drag = map.reduce_scalar(model.lumped_drag());
  system.loads.force.resize(rest.size());
  for (int i = 0; i < model.control_point_count(); ++i)
    system.loads.force.segment<3>(3 * i) << 0, 0, -9.81 * model.lumped_mass()[i];
  std::vector<StrainRow> rows = select_rows(model, map, model.lumped_mass(), points, {});
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

TEST(PointRule, CubicClothSwingsLikeQuadraticClothAndKeepsItsLengthBetweenThePoints) {
  const Swing quadratic = swing(square(2, 8), PointRule::border), cubic = swing(square(3, 7), PointRule::border);
  EXPECT_LT((cubic.corner - quadratic.corner).norm(), 0.010);
  EXPECT_LT(cubic.largest, 0.01);
  // What the rule is for: with the knot mesh alone the border stretches by a tenth and the corner runs ahead.
  const Swing knot_mesh = swing(square(3, 7), PointRule::knot_mesh);
  EXPECT_GT(knot_mesh.largest, 0.05);
  EXPECT_GT((knot_mesh.corner - quadratic.corner).norm(), 0.010);
}

TEST(PointRule, AsManyLinesAsControlPoints) {
  for (const int degree : {3, 4, 5})
    for (const int spans : {1, 2, 7}) {
      const TrimmedSurface face = square(degree, spans);
      const TrimTopology topology = trace_trims(face);
      std::set<double> lines(topology.mesh.u.begin(), topology.mesh.u.end());
      for (const ConstraintPoint& point : points_for_degree(face, topology)) lines.insert(point.u);
      EXPECT_EQ(static_cast<int>(lines.size()), face.surface.count_u()) << degree << ' ' << spans;
      for (const PointRule rule : {PointRule::border, PointRule::cells, PointRule::half})
        for (const ConstraintPoint& point : points_for_degree(face, topology, rule)) {
          const bool vertex = std::ranges::binary_search(topology.mesh.u, point.u) &&
                              std::ranges::binary_search(topology.mesh.v, point.v);
          EXPECT_FALSE(vertex) << point.u << ' ' << point.v;
        }
    }
}

TEST(PointRule, SmoothQuadraticPanelsGetNothing) {
  const TrimmedSurface face = square(2, 5);
  EXPECT_TRUE(points_for_degree(face, trace_trims(face)).empty());
}

TEST(PointRule, AFoldedQuadraticClothKeepsItsLengthBesideTheFold) {
  const std::vector<double> fold{0.5};
  const TrimmedSurface face =
      untrimmed(insert_knots(insert_knots(square(2, 8).surface, Direction::u, fold), Direction::v, fold));
  const Swing folded = swing(face, PointRule::border), smooth = swing(square(2, 8), PointRule::border);
  EXPECT_LT(folded.largest, 0.01);
  EXPECT_LT((folded.corner - smooth.corner).norm(), 0.020);
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
  const std::vector<ConstraintPoint> points = points_for_degree(face, topology);
  EXPECT_GT(points.size(), 0u);
  for (const ConstraintPoint& point : points)
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector2d along = corners[(k + 1) % 3] - corners[k];
      const Eigen::Vector2d to = Eigen::Vector2d(point.u, point.v) - corners[k];
      EXPECT_GE(along.x() * to.y() - along.y() * to.x(), -1e-12) << point.u << ' ' << point.v;
    }
}

}  // namespace
}  // namespace toile
