// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/constraint/averaged_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "support/near.h"
#include "support/panels.h"

namespace toile {
namespace {

struct Cloth {
  TrimmedSurface face;
  TrimTopology topology;
  ShellModel model;
};
Cloth cloth(TrimmedSurface face, double grain = 0) {
  TrimTopology topology = trace_trims(face);
  ClothPanel panel = test::make_panel(face.surface);
  panel.quadrature = quadrature(face, topology);
  panel.grain = grain;
  std::vector<ClothPanel> panels{panel};
  return {face, topology, ShellModel(std::move(panels))};
}
TrimmedSurface square(int degree, int spans) {
  return untrimmed(test::flat_surface(1, 1, uniform_knots(degree, spans), uniform_knots(degree, spans)));
}
TrimmedSurface triangle(int degree, int spans) {
  TrimmedSurface face = square(degree, spans);
  const Eigen::Vector2d corners[] = {{0.03, 0.02}, {0.98, 0.11}, {0.52, 0.97}};
  face.loops = {{}};
  for (int k = 0; k < 3; ++k)
    face.loops[0].curves.push_back({line_segment<2>(corners[k], corners[(k + 1) % 3]), k, false, {}});
  face.natural_bounds = false;
  return face;
}
// A sheet that is curved at rest.
TrimmedSurface arched(int degree, int spans) {
  TrimmedSurface face = square(degree, spans);
  Eigen::Matrix3Xd net = face.surface.points();
  for (int k = 0; k < net.cols(); ++k) net(2, k) = 0.3 * std::sin(3 * net(0, k)) * std::cos(2 * net(1, k));
  face.surface = face.surface.with_points(std::move(net));
  return face;
}

std::vector<StrainRow> rows_of(const Cloth& c, PointRule rule, const Closure& closure = {}) {
  return averaged_rows(c.model, 0, c.topology, closure, rule);
}
double strain(const StrainRow& row, const Eigen::VectorXd& q) {
  Eigen::Vector3d y = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < row.row.index.size(); ++k) y += row.row.value[k] * q.segment<3>(3 * row.row.index[k]);
  return 0.5 * (y.squaredNorm() - 1);
}
// Places after the linear map (x, y) -> A (x, y).
Eigen::VectorXd mapped(const Eigen::VectorXd& rest, const Eigen::Matrix2d& a) {
  Eigen::VectorXd q = rest;
  for (int k = 0; k < rest.size(); k += 3) q.segment<2>(k) = a * rest.segment<2>(k);
  return q;
}

constexpr PointRule rules[] = {PointRule::cell_average, PointRule::springs_quad, PointRule::springs_triangle};

TEST(AveragedRows, ClothAtRestIsUnstrained) {
  for (const TrimmedSurface& face : {square(2, 4), triangle(3, 5), arched(2, 4), arched(3, 3)}) {
    const Cloth c = cloth(face, 0.3);
    for (const PointRule rule : rules) {
      const auto rows = rows_of(c, rule);
      EXPECT_FALSE(rows.empty());
      for (const StrainRow& row : rows) {
        EXPECT_NEAR(strain(row, c.model.rest()), 0, 1e-12);
        EXPECT_NEAR(row.thread.norm(), 1, 1e-12);
      }
    }
  }
}

// A uniform deformation strains each row by the strain of its own direction: cells by E of the threads, springs by E
// along the net, whatever the grain.
TEST(AveragedRows, AUniformStrainIsSeenAlongEachRowsThread) {
  Eigen::Matrix2d a;
  a << 1.02, 0.03, -0.01, 0.97;
  const Eigen::Matrix2d e = 0.5 * (a.transpose() * a - Eigen::Matrix2d::Identity());
  for (const double grain : {0.0, 0.4}) {
    const Eigen::Vector2d weft(std::cos(grain), std::sin(grain)), warp(-weft.y(), weft.x());
    for (const TrimmedSurface& face : {square(2, 4), triangle(3, 5)}) {
      const Cloth c = cloth(face, grain);
      const Eigen::VectorXd q = mapped(c.model.rest(), a);
      for (const PointRule rule : rules)
        for (const StrainRow& row : rows_of(c, rule)) {
          const Eigen::Vector2d along = row.thread[0] * weft + row.thread[1] * warp;
          EXPECT_NEAR(strain(row, q), along.dot(e * along), 1e-12);
          if (rule != PointRule::cell_average) continue;
          EXPECT_EQ(row.thread, Eigen::Vector2d::Unit(row.warp));
        }
    }
  }
}

TEST(AveragedRows, SpringsAreTheEdgesOfTheKnotMeshAndTheirLengthsCount) {
  const Cloth c = cloth(square(3, 4));
  const auto quads = rows_of(c, PointRule::springs_quad), triangles = rows_of(c, PointRule::springs_triangle);
  EXPECT_EQ(quads.size(), 2u * 4 * 5);
  EXPECT_EQ(triangles.size(), 2u * 4 * 5 + 16);
  // eq. 35, l / L - 1, to first order.
  Eigen::VectorXd q = c.model.rest();
  for (int k = 0; k < q.size(); k += 3) q[k] += 1e-6 * std::sin(3 * q[k]);
  for (const StrainRow& row : quads) {
    const Eigen::Vector2d half = 0.125 * (row.warp ? Eigen::Vector2d::UnitY() : Eigen::Vector2d::UnitX());
    const Eigen::Vector2d a = row.uv - half, b = row.uv + half;
    const double l = (c.model.state(0, b[0], b[1], q).position - c.model.state(0, a[0], a[1], q).position).norm();
    EXPECT_NEAR(strain(row, q), l / 0.25 - 1, 1e-11);
  }
}

TEST(AveragedRows, AreasAddUpToTheCloth) {
  for (const TrimmedSurface& face : {square(2, 4), triangle(3, 5)}) {
    const Cloth c = cloth(face);
    double cells = 0, along_u = 0;
    for (const StrainRow& row : rows_of(c, PointRule::cell_average)) cells += row.warp ? 0 : row.area;
    for (const StrainRow& row : rows_of(c, PointRule::springs_quad)) along_u += row.warp ? 0 : row.area;
    const double area = c.model.lumped_mass().sum() / c.model.panels()[0].fabric.density;
    expect_near_rel(cells, area, 1e-12);
    if (face.natural_bounds) {
      expect_near_rel(along_u, area, 1e-12);
    }
  }
}

TEST(AveragedRows, TrimmedAwayVerticesHoldNoSprings) {
  const Cloth c = cloth(triangle(2, 8));
  const auto rows = rows_of(c, PointRule::springs_triangle);
  EXPECT_GT(rows.size(), 20u);
  for (const StrainRow& row : rows) {
    const Eigen::Vector2d half = row.thread.cwiseAbs().maxCoeff() > 0.9
                                     ? Eigen::Vector2d(row.thread / 16)
                                     : Eigen::Vector2d(row.thread * std::numbers::sqrt2 / 16);
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector2d end = row.uv + side * half;
      EXPECT_TRUE(contains(c.face, c.topology, {std::round(8 * end[0]) / 8, std::round(8 * end[1]) / 8}));
    }
  }
}

TEST(AveragedRows, SpringsOnASeamAreTakenOnce) {
  const Cloth c = cloth(square(2, 4));
  const auto open = rows_of(c, PointRule::springs_quad), closed = rows_of(c, PointRule::springs_quad, {true, false});
  EXPECT_EQ(open.size(), closed.size() + 4);
  double warp = 0;
  for (const StrainRow& row : closed) warp += row.warp ? row.area : 0;
  expect_near_rel(warp, 1, 1e-12);
}

}  // namespace
}  // namespace toile
