// SPDX-License-Identifier: GPL-3.0-or-later
// Triangles that keep to knot cells.
#include "trimming/cell_triangles.h"

#include <cmath>
#include <numbers>

#include "geometry/error.h"
#include "trim_cases.h"
#include "trims.h"

namespace toile::test {
namespace {

double signed_area(const CellTriangles& mesh, std::size_t k) {
  const auto& t = mesh.triangles[k];
  const Vector2d a = mesh.uv[static_cast<std::size_t>(t[0])], b = mesh.uv[static_cast<std::size_t>(t[1])] - a,
                 c = mesh.uv[static_cast<std::size_t>(t[2])] - a;
  return (b.x() * c.y() - b.y() * c.x()) / 2;
}

// The laws of the header; the area of what they cover.
double expect_cells(const TrimmedSurface& surface, const TrimTopology& topology, std::pair<int, int> divisions) {
  const CellTriangles mesh = triangulate_cells(surface, topology, divisions);
  EXPECT_EQ(mesh.cell.size(), mesh.triangles.size());
  double area = 0;
  std::map<std::array<int, 2>, int> edges;
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
    EXPECT_GT(signed_area(mesh, k), -1e-15);
    area += signed_area(mesh, k);
    const int i = mesh.cell[k] % topology.mesh.cells_u(), j = mesh.cell[k] / topology.mesh.cells_u();
    for (std::size_t c = 0; c < 3; ++c) {
      const int v = mesh.triangles[k][c];
      const Vector2d uv = mesh.uv[static_cast<std::size_t>(v)];
      EXPECT_LE(topology.mesh.u[static_cast<std::size_t>(i)], uv.x());
      EXPECT_GE(topology.mesh.u[static_cast<std::size_t>(i) + 1], uv.x());
      EXPECT_LE(topology.mesh.v[static_cast<std::size_t>(j)], uv.y());
      EXPECT_GE(topology.mesh.v[static_cast<std::size_t>(j) + 1], uv.y());
      EXPECT_EQ(++(edges[{v, mesh.triangles[k][(c + 1) % 3]}]), 1);
    }
  }
  std::set<std::pair<double, double>> places;
  for (const Vector2d& uv : mesh.uv) EXPECT_TRUE(places.emplace(uv.x(), uv.y()).second);
  // Inside the material every edge has two triangles, between cells too: what is left alone runs around it.
  for (const auto& [edge, count] : edges) {
    if (edges.contains({edge[1], edge[0]})) continue;
    const Vector2d middle =
        (mesh.uv[static_cast<std::size_t>(edge[0])] + mesh.uv[static_cast<std::size_t>(edge[1])]) / 2;
    const Vector2d along = mesh.uv[static_cast<std::size_t>(edge[1])] - mesh.uv[static_cast<std::size_t>(edge[0])];
    const Vector2d beyond = middle + 0.3 * Vector2d(along.y(), -along.x());
    EXPECT_FALSE(contains(surface, topology, beyond)) << middle.transpose();
  }
  return area;
}

TEST(CellTriangles, AnUntrimmedPanelIsALattice) {
  TrimmedSurface surface = trimmed(unit_cells(3), {polygon_loop({{0, 0}, {3, 0}, {3, 3}, {0, 3}})});
  validate_loops(surface);
  const CellTriangles mesh = triangulate_cells(surface, trace_trims(surface), {3, 2});
  EXPECT_EQ(mesh.triangles.size(), 9u * 12);
  EXPECT_EQ(mesh.uv.size(), 10u * 7);
}

TEST(CellTriangles, CoverADiscBetterAndBetter) {
  double last = 1;
  for (const int n : {2, 4, 8}) {
    TrimmedSurface surface = trimmed(unit_cells(4), {loop_of({round_curve({2.1, 1.9}, 1.6)})});
    validate_loops(surface);
    const double area = expect_cells(surface, trace_trims(surface), {n, n});
    const double missing = std::numbers::pi * 1.6 * 1.6 - area;
    EXPECT_GT(missing, 0);
    EXPECT_LT(missing, 0.4 * last);  // second order
    last = missing;
  }
  EXPECT_LT(last, 0.01);
}

TEST(CellTriangles, HolesStayHoles) {
  TrimmedSurface surface =
      trimmed(unit_cells(4), {polygon_loop({{0, 0}, {4, 0}, {4, 4}, {0, 4}}),
                              polygon_loop({{1.25, 1.25}, {1.25, 2.5}, {2.5, 2.5}, {2.5, 1.25}}, LoopKind::hole)});
  validate_loops(surface);
  EXPECT_NEAR(expect_cells(surface, trace_trims(surface), {4, 4}), 16 - 1.25 * 1.25, 1e-12);
}

// A hole between a quarter of the rim and its chord: CGAL makes the vertices where the chord crosses the hole. What
// lies within the chord or the hole, and not in both, counts as material.
TEST(CellTriangles, ChordsThatCrossMeetInVertices) {
  const Vector2d centre(0.5, 0.5), out = Vector2d(1, 1).normalized(), along = Vector2d(-1, 1).normalized();
  const double radius = 0.45, chord = radius * std::sqrt(0.5), from = 0.3, to = 0.4, half = 0.05;
  const auto corner = [&](double d, double t) -> Vector2d { return centre + d * out + t * along; };
  const std::vector<Vector2d> hole{corner(from, -half), corner(from, half), corner(to, half), corner(to, -half)};
  TrimmedSurface surface =
      trimmed(unit_cells(2), {loop_of({round_curve(centre, radius)}), polygon_loop(hole, LoopKind::hole)});
  validate_loops(surface);
  const CellTriangles mesh = triangulate_cells(surface, trace_trims(surface), {1, 1});
  EXPECT_EQ(mesh.uv.size(), 4u + 4 + 2);
  double area = 0;
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
    EXPECT_GT(signed_area(mesh, k), 0);
    area += signed_area(mesh, k);
  }
  EXPECT_NEAR(area, 2 * radius * radius + 2 * half * ((to - chord) - (chord - from)), 1e-14);
}

TEST(CellTriangles, TooManyAndNoneAreRefused) {
  TrimmedSurface surface = trimmed(unit_cells(2), {polygon_loop({{0, 0}, {2, 0}, {2, 2}, {0, 2}})});
  validate_loops(surface);
  const TrimTopology topology = trace_trims(surface);
  EXPECT_THROW(triangulate_cells(surface, topology, {0, 1}), GeometryError);
  EXPECT_THROW(triangulate_cells(surface, topology, {10000, 10000}), GeometryError);
}

}  // namespace
}  // namespace toile::test
