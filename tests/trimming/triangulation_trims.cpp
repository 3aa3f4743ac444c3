// Triangulation over traced trims.
#include <cmath>
#include <numbers>

#include "triangles.h"
#include "trims.h"

namespace toile::test {
namespace {

TrimmedTriangles mesh_of(const TrimmedSurface& surface, const TriangulationOptions& options = {}) {
  const TrimTopology topology = trace_trims(surface);
  const TrimmedTriangles mesh = triangulate(surface, topology, options);
  expect_conforming(mesh, topology.mesh);
  return mesh;
}

TEST(Triangulation, DiscsOnGridsConform) {
  for (const int n : {1, 3, 6})
    for (const double r : {0.45, 0.2})
      for (const int per_cell : {1, 4}) {
        const Vector2d centre(0.51 * n, 0.49 * n);
        const TrimmedTriangles mesh =
            mesh_of(trimmed(unit_cells(n), {loop_of({round_curve(centre, r * n)})}), {.per_cell = per_cell});
        expect_near_rel(area_of(mesh), std::numbers::pi * r * r * n * n, 0, 2 * std::numbers::pi * r * n * 0.005);
        for (const auto& [a, b] : boundary_edges(mesh)) {
          expect_near_rel((mesh.uv[a] - centre).norm(), r * n, 1e-14);
          expect_near_rel((mesh.uv[b] - centre).norm(), r * n, 1e-14);
        }
      }
}

TEST(Triangulation, PolygonsWithHolesConform) {
  const std::vector<Vector2d> outer = {{0.25, 0.125}, {5.5, 0.25}, {5.75, 4}, {3, 5.875}, {2.5, 3.25}, {0.125, 5.5}};
  const std::vector<Vector2d> hole = {{1.25, 1.5}, {1.5, 2.75}, {3.25, 2.25}};
  const TrimmedSurface surface = trimmed(unit_cells(6), {polygon_loop(outer), polygon_loop(hole, LoopKind::hole)});
  expect_near_rel(area_of(mesh_of(surface)), loop_area(surface), 1e-13);
}

// A disc that touches knot lines from inside, one that passes them by little, and trims along knot lines.
TEST(Triangulation, TouchesAndRunsConform) {
  mesh_of(trimmed(unit_cells(5), {loop_of({round_curve({2.5, 2.5}, 1.5)})}));
  for (double eps = 1e-3; eps > 5e-11; eps /= 10) {
    mesh_of(trimmed(unit_cells(5), {loop_of({round_curve({2.5, 2.5}, 1.5 + eps)})}));
    mesh_of(trimmed(unit_cells(5), {loop_of({round_curve({2.5, 2.5}, 1.5 - eps)})}));
  }
  const std::vector<Vector2d> steps = {{1, 1}, {4, 1}, {4, 2}, {3.5, 2}, {3, 3}, {1, 3}};
  const TrimmedSurface surface = trimmed(unit_cells(5), {polygon_loop(steps)});
  expect_near_rel(area_of(mesh_of(surface)), loop_area(surface), 1e-13);
}

// A hole that touches a knot line from one side: the whole cell on the other side takes the point too.
TEST(Triangulation, TouchFromBesideIsNoTJunction) {
  const std::vector<Vector2d> outer = {{0, 0}, {3, 0}, {3, 3}, {0, 3}};
  const std::vector<Vector2d> hole = {{1.0, 1.3}, {1.5, 1.75}, {1.75, 1.25}};
  const TrimmedSurface surface = trimmed(unit_cells(3), {polygon_loop(outer), polygon_loop(hole, LoopKind::hole)});
  const TrimmedTriangles mesh = mesh_of(surface);
  expect_near_rel(area_of(mesh), loop_area(surface), 1e-13);
  EXPECT_NE(std::find(mesh.uv.begin(), mesh.uv.end(), Vector2d(1.0, 1.3)), mesh.uv.end());
}

TEST(Triangulation, UncutPanelIsAGrid) {
  TrimmedSurface surface = trimmed(unit_cells(3), {});
  surface.loops = {natural_loop(surface.surface)};
  const TrimmedTriangles mesh = mesh_of(surface, {.per_cell = 2});
  EXPECT_EQ(mesh.uv.size(), 49u);
  EXPECT_EQ(mesh.triangles.size(), 72u);
}

}  // namespace
}  // namespace toile::test
