// Triangulation of cut cells made by hand.
#include <cmath>
#include <numbers>

#include "hand_made.h"
#include "triangles.h"
#include "trimming/triangulation.h"

namespace toile::test {
namespace {

TrimmedTriangles mesh_of(const HandMade& made, const TriangulationOptions& options = {}) {
  const TrimmedTriangles mesh = triangulate(made.surface, made.topology, options);
  expect_conforming(mesh, made.topology.mesh);
  return mesh;
}

TEST(Triangulation, PolygonsAreCoveredExactly) {
  const std::vector<std::vector<Vector2d>> polygons = {
      {{0, 0}, {1, 0}, {0, 1}},
      {{0, 0}, {0.25, 0}, {0, 0.375}},
      {{0.25, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0.125}},
      {{0, 0}, {0.625, 0}, {0.375, 1}, {0, 1}},
      {{0, 0}, {1, 0}, {1, 1}, {0.75, 1}, {0.75, 0.25}, {0.5, 0.25}, {0.5, 0.75}, {0.375, 1}, {0, 1}}};
  for (const auto& corners : polygons)
    for (const int per_cell : {1, 2, 4, 7})
      expect_near_rel(area_of(mesh_of(cut_cell(2, {polygon(corners)}), {.per_cell = per_cell})),
                      exact_moment(corners, 0, 0).convert_to<double>(), 1e-14);
}

TEST(Triangulation, SliversAreCovered) {
  for (double eps = 1e-3; eps > 5e-11; eps /= 10) {
    // At the origin every coordinate is exact.
    for (const auto& corners :
         std::vector<std::vector<Vector2d>>{{{0, 0}, {eps, 0}, {0, 0.5}}, {{0, 0}, {eps, 0}, {0, eps}}})
      expect_near_rel(area_of(mesh_of(cut_cell(2, {polygon(corners)}))),
                      exact_moment(corners, 0, 0).convert_to<double>(), 1e-14);
    // Elsewhere points are rounded.
    for (const auto& corners :
         std::vector<std::vector<Vector2d>>{{{0, 0.5}, {1, 0.5}, {1, 0.5 + eps}, {0, 0.5 + 0.5 * eps}},
                                            {{0, 0}, {eps, 0}, {1, 0.75}, {1, 0.75 + eps}},
                                            {{0, 0}, {1, 0}, {1, 1 - eps}, {0, 1}}})
      expect_near_rel(area_of(mesh_of(cut_cell(2, {polygon(corners)}))),
                      exact_moment(corners, 0, 0).convert_to<double>(), 1e-14, 1e-16);
  }
}

// A chord of sagitta s leaves out 2/3 of s times its length, so the area is within s times the circumference.
TEST(Triangulation, CurvesAreFollowedWithinTheChord) {
  for (const double chord : {0.05, 0.005, 0.0005})
    for (const double r : {0.45, 0.1}) {
      const Curve2 circle = circular_arc({0.5, 0.5}, r, 0, 2 * std::numbers::pi);
      const TrimmedTriangles mesh = mesh_of(cut_cell(2, {{trim(circle)}}), {.per_cell = 4, .chord = chord});
      for (const auto& p : mesh.uv) EXPECT_LE((p - Vector2d(0.5, 0.5)).norm(), r + 1e-15);
      for (const auto& [a, b] : boundary_edges(mesh)) {
        expect_near_rel((mesh.uv[a] - Vector2d(0.5, 0.5)).norm(), r, 1e-14);
        EXPECT_GE(((mesh.uv[a] + mesh.uv[b]) / 2 - Vector2d(0.5, 0.5)).norm(), r - chord);
      }
      expect_near_rel(area_of(mesh), std::numbers::pi * r * r, 0, 2 * std::numbers::pi * r * chord);
    }
}

TEST(Triangulation, HolesStayOpen) {
  const Curve2 circle = circular_arc({0.5, 0.5}, 0.3, 0, 2 * std::numbers::pi);
  Side hole = trim(circle, circle.domain().max, circle.domain().min);
  const TrimmedTriangles mesh = mesh_of(cut_cell(2, {polygon({{0, 0}, {1, 0}, {1, 1}, {0, 1}}), {hole}}));
  expect_near_rel(area_of(mesh), 1 - std::numbers::pi * 0.09, 0, 0.01);
  for (const auto& p : mesh.uv) EXPECT_GE((p - Vector2d(0.5, 0.5)).norm(), 0.3 - 1e-14);
}

// The strip between an arch and the same arch eps higher, its upper side in two curves: flattened coarsely, the two
// sides would cross.
TEST(Triangulation, MaterialThinnerThanTheChord) {
  for (double eps = 1e-2; eps > 5e-6; eps /= 10) {
    const Curve2 lower = bezier({{0, 0.1}, {0.5, 1.5}, {1, 0.1}});
    const Curve2 above = bezier({{0, 0.1 + eps}, {0.5, 1.5 + eps}, {1, 0.1 + eps}});
    const TrimmedTriangles mesh =
        mesh_of(cut_cell(2, {{trim(lower), border({1, 0.1}, {1, 0.1 + eps}), trim(above, 1, 0.3), trim(above, 0.3, 0),
                              border({0, 0.1 + eps}, {0, 0.1})}}));
    EXPECT_GT(area_of(mesh), 0.5 * eps);  // exactly eps, with perfect arcs
    EXPECT_LT(area_of(mesh), 2 * eps);
  }
}

}  // namespace
}  // namespace toile::test
