// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes of trimmed panels.
#include <cmath>
#include <numbers>

#include "geometry/error.h"
#include "trim_cases.h"
#include "trimming/triangulation.h"
#include "trims.h"

namespace toile::test {
namespace {

constexpr double degree = std::numbers::pi / 180;

double signed_area(const TrimmedTriangles& mesh, std::size_t k) {
  const auto& t = mesh.triangles[k];
  const Vector2d a = mesh.uv[static_cast<std::size_t>(t[0])], b = mesh.uv[static_cast<std::size_t>(t[1])] - a,
                 c = mesh.uv[static_cast<std::size_t>(t[2])] - a;
  return (b.x() * c.y() - b.y() * c.x()) / 2;
}

double area_of(const TrimmedTriangles& mesh) {
  double area = 0;
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) area += signed_area(mesh, k);
  return area;
}

// Edges of one triangle only, directed with it.
std::vector<std::array<int, 2>> boundary_edges(const TrimmedTriangles& mesh) {
  std::set<std::array<int, 2>> edges;
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) edges.insert({t[k], t[(k + 1) % 3]});
  std::vector<std::array<int, 2>> boundary;
  for (const auto& [a, b] : edges)
    if (!edges.contains({b, a})) boundary.push_back({a, b});
  return boundary;
}

//   (1) no two vertices in one place, every vertex used, every directed edge once, triangles turn left;
//   (2) boundary vertices lie on their curves; the ends of every edge with one triangle are such vertices;
//   (3) the mesh has as many boundary loops less components as its Euler characteristic says.
void expect_mesh(const TrimmedSurface& surface, const TrimmedTriangles& mesh) {
  ASSERT_FALSE(mesh.triangles.empty());
  std::map<std::pair<double, double>, int> places;
  for (const auto& p : mesh.uv) EXPECT_EQ(++places[std::make_pair(p.x(), p.y())], 1);
  std::vector<int> used(mesh.uv.size(), 0);
  std::map<std::array<int, 2>, int> edges;
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
    EXPECT_GE(signed_area(mesh, k), -1e-15);
    for (std::size_t c = 0; c < 3; ++c) {
      used[static_cast<std::size_t>(mesh.triangles[k][c])] = 1;
      EXPECT_EQ(++(edges[{mesh.triangles[k][c], mesh.triangles[k][(c + 1) % 3]}]), 1);
    }
  }
  for (const int u : used) EXPECT_EQ(u, 1);
  std::set<int> on_trim;
  for (const BoundaryVertex& b : mesh.boundary) {
    const Curve2& curve =
        surface.loops[static_cast<std::size_t>(b.loop)].curves[static_cast<std::size_t>(b.curve)].curve;
    EXPECT_LE((curve(b.t) - mesh.uv[static_cast<std::size_t>(b.vertex)]).norm(), 1e-14);
    on_trim.insert(b.vertex);
  }
  for (const auto& [a, b] : boundary_edges(mesh)) EXPECT_TRUE(on_trim.contains(a) && on_trim.contains(b));
}

TrimmedTriangles mesh_of(TrimmedSurface surface, const TriangulationOptions& options = {}) {
  validate_loops(surface);
  const TrimmedTriangles mesh = triangulate(surface, trace_trims(surface), options);
  expect_mesh(surface, mesh);
  return mesh;
}

TEST(Triangulation, DiscsAreWellShaped) {
  for (const double size : {0.5, 0.2, 0.05}) {
    const TrimmedTriangles mesh =
        mesh_of(trimmed(unit_cells(4), {loop_of({round_curve({2.1, 1.9}, 1.6)})}), {.size = size, .given = {}});
    EXPECT_GT(mesh.quality.smallest_angle, 20 * degree) << size;
    EXPECT_LT(mesh.quality.longest_edge, 1.4 * size);
    EXPECT_GT(mesh.quality.shortest_edge, 0.2 * size);
    // Chords leave out at most their sagitta along the circumference.
    expect_near_rel(area_of(mesh), std::numbers::pi * 2.56, 0, 2 * std::numbers::pi * 1.6 * 0.02 * size);
    for (const auto& [a, b] : boundary_edges(mesh)) {
      const Vector2d middle = (mesh.uv[static_cast<std::size_t>(a)] + mesh.uv[static_cast<std::size_t>(b)]) / 2;
      EXPECT_GE((middle - Vector2d(2.1, 1.9)).norm(), 1.6 - 0.0201 * size);
    }
  }
}

TEST(Triangulation, PolygonsWithHolesAreCoveredExactly) {
  const std::vector<Vector2d> outer = {{0.25, 0.125}, {5.5, 0.25}, {5.75, 4}, {3, 5.875}, {2.5, 3.25}, {0.125, 5.5}};
  const std::vector<Vector2d> hole = {{1.25, 1.5}, {1.5, 2.75}, {3.25, 2.25}};
  const TrimmedSurface surface = trimmed(unit_cells(6), {polygon_loop(outer), polygon_loop(hole, LoopKind::hole)});
  const TrimmedTriangles mesh = mesh_of(surface, {.size = 0.25, .given = {}});
  expect_near_rel(area_of(mesh), loop_area(surface), 1e-13);
  EXPECT_GT(mesh.quality.smallest_angle, 17 * degree);
  EXPECT_LT(mesh.quality.longest_edge, 0.35);
}

// Size and angles are those of the surface, not of its parameters: a strip 3 m x 0.5 m over [0, 1]^2, slanted.
TEST(Triangulation, AffinePanelsAreMeshedInTheirOwnPlane) {
  Eigen::Matrix3Xd net(3, 4);
  net << 0, 3, 0.4, 3.4, 0, 0, 0.3, 0.3, 0, 0, 0, 0;
  const TrimmedSurface face = untrimmed(knot_plane({0, 1}, {0, 1}).with_points(net));
  const TrimmedTriangles mesh = mesh_of(face, {.size = 0.05, .given = {}});
  EXPECT_GT(mesh.quality.smallest_angle, 20 * degree);
  EXPECT_LT(mesh.quality.longest_edge, 0.07);
  EXPECT_GT(mesh.quality.shortest_edge, 0.0125);
}

// A quarter of a cylinder, rational: the size holds in space.
TEST(Triangulation, CurvedPanelsKeepTheSizeInSpace) {
  const double h = std::sqrt(0.5);
  Eigen::Matrix3Xd net(3, 6);
  net << 2, 2, 0, 2, 2, 0, 0, 2, 2, 0, 2, 2, 0, 0, 0, 3, 3, 3;
  TrimmedSurface face = trimmed(NurbsSurface(uniform_knots(2, 1), uniform_knots(1, 1), net, {1, h, 1, 1, h, 1}),
                                {loop_of({round_curve({0.5, 0.5}, 0.4)})});
  const TrimmedTriangles mesh = mesh_of(face, {.size = 0.1, .given = {}});
  EXPECT_LT(mesh.quality.longest_edge, 0.16);
  EXPECT_GT(mesh.quality.smallest_angle, 18 * degree);
}

// The unit square with one heavy or light control point. A heavy one draws its cells together but for a seam of
// 1/sqrt(weight) of their width, which takes triangles of that width along its whole length.
TEST(Triangulation, AHeavyWeightTakesNoMoreTrianglesThanItsSeam) {
  const KnotVector knots = uniform_knots(2, 8);
  const int n = knots.control_point_count();
  Eigen::Matrix3Xd net(3, n * n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) net.col(i + n * j) << knots.greville(i), knots.greville(j), 0;
  const auto count = [&](double weight) {
    std::vector<double> weights(static_cast<std::size_t>(n * n), 1);
    weights[static_cast<std::size_t>(n / 2 * (n + 1))] = weight;
    const TrimmedSurface face = untrimmed(NurbsSurface(knots, knots, net, weights));
    return static_cast<double>(mesh_of(face, {}).triangles.size());
  };
  const double plain = count(1);
  for (const double weight : {1e-4, 1e2, 1e4})
    EXPECT_LT(count(weight), 2 * plain * std::max(1.0, std::sqrt(weight))) << weight;
}

// Two panels that are given the same places along a side have exactly these there, whatever their sizes.
TEST(Triangulation, SeamsMatch) {
  const std::vector<double> places = {0.1, 0.25, 0.375, 0.5, 0.8};
  for (const double size : {0.4, 0.1}) {
    TrimmedSurface face = trimmed(unit_cells(2), {polygon_loop({{0, 0}, {2, 0}, {2, 2}, {0, 2}})});
    face.loops[0].curves[1].curve = bezier_curve({{2, 0}, {1.5, 1}, {2, 2}});
    const TrimmedTriangles mesh = mesh_of(face, {.size = size, .given = {{0, 1, places}}});
    std::vector<double> found;
    for (const BoundaryVertex& b : mesh.boundary)
      if (b.curve == 1) found.push_back(b.t);
    std::vector<double> expected{0};
    expected.insert(expected.end(), places.begin(), places.end());
    EXPECT_EQ(found, expected);
    std::size_t along = 0;
    for (const auto& [a, b] : boundary_edges(mesh)) {
      const auto on = [&](int v) {
        return std::any_of(mesh.boundary.begin(), mesh.boundary.end(), [&](const BoundaryVertex& x) {
          return x.vertex == v && (x.curve == 1 || (x.curve == 2 && x.t == 0));
        });
      };
      along += on(a) && on(b);
    }
    EXPECT_EQ(along, places.size() + 1);
  }
}

TEST(Triangulation, RefusesWhatItCantDo) {
  const TrimmedSurface face = trimmed(unit_cells(2), {polygon_loop({{0, 0}, {2, 0}, {2, 2}, {0, 2}})});
  const TrimTopology topology = trace_trims(face);
  for (const double size : {0.0, -1.0, std::nan(""), 1e-9})
    EXPECT_THROW(triangulate(face, topology, {.size = size, .given = {}}), GeometryError);
  EXPECT_THROW(triangulate(face, topology, {.size = 0.5, .given = {{0, 1, {0.5, 0.25}}}}), GeometryError);
  EXPECT_THROW(triangulate(face, topology, {.size = 0.5, .given = {{0, 1, {1.5}}}}), GeometryError);
  EXPECT_THROW(triangulate(face, topology, {.size = 0.5, .given = {{0, 4, {0.5}}}}), GeometryError);
  EXPECT_THROW(triangulate(face, topology, {.size = 0.5, .chord = 0, .given = {}}), GeometryError);
  const TrimmedSurface lens = trimmed(
      unit_cells(2), {loop_of({bezier_curve({{0, 1}, {1, 0}, {2, 1}}), bezier_curve({{2, 1}, {1, 2}, {0, 1}})})});
  EXPECT_THROW(triangulate(lens, trace_trims(lens), {.size = 0.5, .given = {{0, 0, {}}, {0, 1, {}}}}), GeometryError);
  // Given points so far apart that the chords between them cross the hole.
  const TrimmedSurface holed =
      trimmed(unit_cells(2), {loop_of({round_curve({1, 1}, 1)}), backwards(loop_of({round_curve({1, 1}, 0.9)}))});
  EXPECT_THROW(
      triangulate(holed, trace_trims(holed), {.size = 0.5, .given = {{0, 0, {1, 2, 3}}, {1, 0, {0.5, 1.5, 2.5, 3.5}}}}),
      GeometryError);
}

// A strip between two arches, down to a thousandth of the size.
TEST(Triangulation, ThinMaterialIsCovered) {
  for (double eps = 1e-1; eps > 5e-5; eps /= 10) {
    const TrimmedSurface face = trimmed(
        unit_cells(3),
        {loop_of({bezier_curve({{0.5, 0.5}, {1.5, 3}, {2.5, 0.5}}), line_segment<2>({2.5, 0.5}, {2.5, 0.5 + eps}),
                  bezier_curve({{2.5, 0.5 + eps}, {1.5, 3 + eps}, {0.5, 0.5 + eps}}),
                  line_segment<2>({0.5, 0.5 + eps}, {0.5, 0.5})})});
    TrimmedSurface given = face;
    validate_loops(given);
    const TrimmedTriangles mesh = mesh_of(face, {.size = 0.2, .given = {}});
    expect_near_rel(area_of(mesh), 2 * eps, 0.25, 0.02);
  }
}

TEST(Triangulation, HolesThatTouchStayOpen) {
  std::vector<TrimLoop> loops = {polygon_loop({{0, 0}, {3, 0}, {3, 3}, {0, 3}})};
  loops.push_back(backwards(polygon_loop({{1, 1}, {2, 1.25}, {2, 1.75}})));
  loops.push_back(backwards(polygon_loop({{1, 1}, {1.75, 2}, {1.25, 2}})));
  loops.push_back(backwards(polygon_loop({{0, 0.5}, {0.5, 0.25}, {0.5, 0.75}})));
  const TrimmedSurface face = trimmed(unit_cells(3), loops);
  expect_near_rel(area_of(mesh_of(face, {.size = 0.2, .given = {}})), loop_area(face), 1e-13);
}

// The generator's trims: the mesh is one and its area that of its polygons.
TEST(Triangulation, HardRandomTrimsAreMeshed) {
  int made = 0;
  for (std::uint64_t seed = 1; made < 100; ++seed) {
    const TrimCase given = random_trim_case(seed);
    if (!given.valid) continue;
    SCOPED_TRACE("seed " + std::to_string(seed) + ", " + given.family);
    ++made;
    TrimmedSurface face = surface_of(given);
    validate_loops(face);
    const TrimmedTriangles mesh = triangulate(face, trace_trims(face), {.size = 0.25, .chord = 0.005, .given = {}});
    expect_mesh(face, mesh);
    double outline = 0;
    for (const auto& [a, b] : boundary_edges(mesh))
      outline += (mesh.uv[static_cast<std::size_t>(a)] - mesh.uv[static_cast<std::size_t>(b)]).norm();
    expect_near_rel(area_of(mesh), loop_area(face), 0, 0.005 * 0.25 * outline + 1e-12);
    if (::testing::Test::HasFailure()) break;
  }
}

}  // namespace
}  // namespace toile::test
