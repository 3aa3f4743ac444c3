// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/mesh_repair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "geometry/error.h"
#include "support/bodies.h"

namespace toile {
namespace {

using Eigen::Vector3d;

TriangleMesh joined(const TriangleMesh& a, TriangleMesh b, const Vector3d& shift) {
  b.vertices.colwise() += shift;
  TriangleMesh out;
  out.vertices.resize(3, a.vertices.cols() + b.vertices.cols());
  out.vertices << a.vertices, b.vertices;
  out.triangles = a.triangles;
  const int first = static_cast<int>(a.vertices.cols());
  for (const Triangle& t : b.triangles) out.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return out;
}

// Every triangle with vertices of its own, as STL has it; each moved by up to `off`.
TriangleMesh soup(const TriangleMesh& mesh, double off) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> random(-off, off);
  TriangleMesh out;
  out.vertices.resize(3, 3 * static_cast<Eigen::Index>(mesh.triangles.size()));
  for (const Triangle& t : mesh.triangles) {
    const int k = 3 * static_cast<int>(out.triangles.size());
    for (int i = 0; i < 3; ++i)
      out.vertices.col(k + i) = mesh.vertices.col(t[i]) + Vector3d(random(engine), random(engine), random(engine));
    out.triangles.push_back({k, k + 1, k + 2});
  }
  return out;
}

void turn(TriangleMesh& mesh, std::size_t f) {
  std::swap(mesh.triangles[f][0], mesh.triangles[f][1]);
}

// Laws (1) and (2).
void expect_sound(const RepairedMesh& result, const TriangleMesh& given) {
  const TriangleMesh& mesh = result.mesh;
  const MeshTopology topology(mesh.triangles, static_cast<int>(mesh.vertices.cols()));
  bool closed = true;
  for (int e = 0; e < topology.edge_count(); ++e) {
    const auto faces = topology.faces_of_edge(e);
    ASSERT_LE(faces.size(), 2u);
    closed = closed && faces.size() == 2;
    if (faces.size() == 2) {
      EXPECT_NE(topology.runs_along(faces[0], e), topology.runs_along(faces[1], e));
    }
  }
  EXPECT_EQ(result.closed, closed);
  ASSERT_EQ(static_cast<Eigen::Index>(result.vertex_of.size()), mesh.vertices.cols());
  for (int v = 0; v < mesh.vertices.cols(); ++v) {
    EXPECT_EQ(mesh.vertices.col(v), given.vertices.col(result.vertex_of[v]));
    // One fan: faces around are joined by edges at v.
    const auto around = topology.faces_of_vertex(v);
    ASSERT_FALSE(around.empty());
    std::vector<int> fan{around[0]};
    for (std::size_t k = 0; k < fan.size(); ++k)
      for (const int e : topology.edges_of_face(fan[k])) {
        if (std::ranges::count(topology.edge(e), v) == 0) continue;
        for (const int f : topology.faces_of_edge(e))
          if (std::ranges::count(fan, f) == 0) fan.push_back(f);
      }
    EXPECT_EQ(fan.size(), around.size());
  }
}

RepairedMesh repaired(const TriangleMesh& given) {
  RepairedMesh result = repair_mesh(given);
  expect_sound(result, given);
  return result;
}

bool says(const std::vector<std::string>& lines, const std::string& words) {
  return std::ranges::any_of(lines, [&](const std::string& line) { return line.find(words) != std::string::npos; });
}

TEST(MeshRepair, LeavesASoundMeshAsItIs) {
  for (const TriangleMesh& mesh : {test::box_mesh({1, 2, 3}), test::torus_mesh(12, 8, 1, 0.3), test::spiky_mesh(10)}) {
    const RepairedMesh result = repaired(mesh);
    EXPECT_TRUE(result.closed);
    EXPECT_TRUE(result.repairs.empty()) << result.repairs[0];
    EXPECT_TRUE(result.warnings.empty()) << result.warnings[0];
    EXPECT_DOUBLE_EQ(test::volume(result.mesh), test::volume(mesh));
    EXPECT_EQ(result.mesh.triangles.size(), mesh.triangles.size());
  }
}

TEST(MeshRepair, JoinsTrianglesThatHaveTheirOwnVertices) {
  const TriangleMesh torus = test::torus_mesh(12, 8, 1, 0.3);
  const RepairedMesh result = repaired(soup(torus, 1e-7));
  EXPECT_TRUE(result.closed);
  EXPECT_EQ(result.mesh.vertices.cols(), torus.vertices.cols());
  EXPECT_TRUE(says(result.repairs, "480 vertices merged"));
  EXPECT_NEAR(test::volume(result.mesh), test::volume(torus), 1e-5);
  // What is a hundredth of a per mille apart is apart.
  EXPECT_EQ(repaired(soup(torus, 1e-4)).mesh.vertices.cols(), 3 * 192);
}

TEST(MeshRepair, TurnsMinoritiesAndBodiesThatAreInsideOut) {
  TriangleMesh some = test::spiky_mesh(10), all = some;
  for (const std::size_t f : {3, 4, 5, 77, 120}) turn(some, f);
  for (std::size_t f = 0; f < all.triangles.size(); ++f) turn(all, f);
  const double right = test::volume(test::spiky_mesh(10));
  EXPECT_NEAR(test::volume(repaired(some).mesh), right, 1e-12);
  EXPECT_TRUE(says(repaired(some).repairs, "5 triangles turned"));
  EXPECT_NEAR(test::volume(repaired(all).mesh), right, 1e-12);
  EXPECT_TRUE(says(repaired(all).repairs, "1 closed surface was inside out"));
}

TEST(MeshRepair, KeepsACavityThatTheFileHas) {
  TriangleMesh inner = test::sphere_mesh(8, 0.4);
  for (std::size_t f = 0; f < inner.triangles.size(); ++f) turn(inner, f);
  const TriangleMesh shell = joined(test::sphere_mesh(12, 1), inner, Vector3d::Zero());
  EXPECT_NEAR(test::volume(repaired(shell).mesh), test::volume(shell), 1e-12);
  TriangleMesh inside_out = shell;
  for (std::size_t f = 0; f < inside_out.triangles.size(); ++f) turn(inside_out, f);
  EXPECT_NEAR(test::volume(repaired(inside_out).mesh), test::volume(shell), 1e-12);
  // Beside each other both face outwards.
  const TriangleMesh beside = joined(test::sphere_mesh(12, 1), inner, Vector3d(3, 0, 0));
  EXPECT_NEAR(test::volume(repaired(beside).mesh),
              test::volume(test::sphere_mesh(12, 1)) + test::volume(test::sphere_mesh(8, 0.4)), 1e-12);
}

TEST(MeshRepair, TakesOutWhatHasNoArea) {
  const TriangleMesh box = test::box_mesh({1, 1, 1});
  TriangleMesh bad = box;
  bad.triangles.push_back({3, 3, 7});
  bad.triangles.push_back(box.triangles[4]);
  bad.triangles.push_back({box.triangles[5][1], box.triangles[5][0], box.triangles[5][2]});
  const RepairedMesh result = repaired(bad);
  EXPECT_TRUE(result.closed);
  EXPECT_EQ(result.mesh.triangles.size(), 12u);
  EXPECT_TRUE(says(result.repairs, "1 triangle without area"));
  EXPECT_TRUE(says(result.repairs, "2 triangles that had a twin"));
}

TEST(MeshRepair, ATriangleOnOneLineOpensNoGap) {
  // The middle of an edge is a vertex on one side only, and a triangle without area fills the gap.
  TriangleMesh box = test::box_mesh({1, 1, 1});
  const Triangle split = box.triangles[0];  // 0 2 1
  box.vertices.conservativeResize(3, 9);
  box.vertices.col(8) = 0.5 * (box.vertices.col(split[0]) + box.vertices.col(split[1]));
  box.triangles[0] = {8, split[1], split[2]};
  box.triangles.push_back({split[0], 8, split[2]});
  box.triangles.push_back({split[0], split[1], 8});
  const RepairedMesh result = repaired(box);
  EXPECT_TRUE(result.closed);
  EXPECT_NEAR(test::volume(result.mesh), 8, 1e-14);
  EXPECT_TRUE(says(result.repairs, "1 triangle with all corners on one line joined"));
  for (const Triangle& t : result.mesh.triangles) {
    const Vector3d a = result.mesh.vertices.col(t[0]);
    EXPECT_GT(Vector3d(result.mesh.vertices.col(t[1]) - a).cross(Vector3d(result.mesh.vertices.col(t[2]) - a)).norm(),
              0.1);
  }
}

// An edge of the box has 41 vertices on one side, and triangles without area fan out from one end of it.
TEST(MeshRepair, ManyTrianglesOnOneLineOpenNoGap) {
  constexpr int parts = 40;
  TriangleMesh box = test::box_mesh({1, 1, 1});
  const auto [a, b, c] = box.triangles[0];
  box.vertices.conservativeResize(3, 8 + parts - 1);
  std::vector<int> along{a};
  for (int k = 1; k < parts; ++k) {
    const double s = static_cast<double>(k) / parts;
    box.vertices.col(7 + k) = (1 - s) * box.vertices.col(a) + s * box.vertices.col(b);
    along.push_back(7 + k);
  }
  along.push_back(b);
  box.triangles.erase(box.triangles.begin());
  for (int k = 0; k < parts; ++k) box.triangles.push_back({along[k], along[k + 1], c});
  for (int k = parts - 1; k > 0; --k) box.triangles.push_back({a, along[k + 1], along[k]});
  const RepairedMesh result = repaired(box);
  EXPECT_TRUE(result.closed);
  EXPECT_NEAR(test::volume(result.mesh), 8, 1e-13);
  for (const auto& [p, q, r] : result.mesh.triangles) {
    const Vector3d x = result.mesh.vertices.col(p), y = result.mesh.vertices.col(q), z = result.mesh.vertices.col(r);
    EXPECT_GT((y - x).cross(z - x).norm(), 1e-3);
  }
}

TEST(MeshRepair, TakesApartWhatMerelyTouches) {
  const TriangleMesh box = test::box_mesh({1, 1, 1});
  for (const Vector3d& shift : {Vector3d(2, 2, 0), Vector3d(2, 2, 2)}) {  // along an edge, at a corner
    const TriangleMesh two = joined(box, box, shift);
    const RepairedMesh result = repaired(two);
    EXPECT_TRUE(result.closed);
    EXPECT_EQ(result.mesh.vertices.cols(), 16);
    EXPECT_NEAR(test::volume(result.mesh), 16, 1e-13);
    EXPECT_TRUE(says(result.repairs, "where parts touch taken apart"));
    int parts = 0;
    connected_parts(MeshTopology(result.mesh.triangles, 16), 24, parts);
    EXPECT_EQ(parts, 2);
  }
}

TEST(MeshRepair, TellsHolesWithTheirPlace) {
  TriangleMesh ball = test::sphere_mesh(12, 1);
  std::erase_if(ball.triangles, [&](const Triangle& t) { return std::ranges::count(t, 12 * 26) > 0; });  // at the pole
  const RepairedMesh result = repaired(ball);
  EXPECT_FALSE(result.closed);
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_TRUE(says(result.warnings, "is open: 1 border")) << result.warnings[0];
  EXPECT_TRUE(says(result.warnings, "around (0, 0, 0.970942)")) << result.warnings[0];  // cos(180/13 degrees)
}

TEST(MeshRepair, RefusesWhatIsNoSurfaceWithThePlace) {
  const auto refusal = [](const TriangleMesh& mesh) {
    try {
      repair_mesh(mesh);
    } catch (const GeometryError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const TriangleMesh box = test::box_mesh({1, 1, 1});
  EXPECT_NE(refusal({}).find("no triangle"), std::string::npos);
  for (const double value : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    TriangleMesh bad = box;
    bad.vertices(2, 5) = value;
    EXPECT_NE(refusal(bad).find("vertex 5 of the mesh is at (1, -1, "), std::string::npos) << refusal(bad);
  }
  TriangleMesh bad = box;
  bad.triangles[3][1] = 8;
  EXPECT_NE(refusal(bad).find("vertex 8 of 8"), std::string::npos);
  bad = box;
  bad.vertices.setConstant(0.5);
  EXPECT_NE(refusal(bad).find("at one place, (0.5, 0.5, 0.5)"), std::string::npos);
}

TEST(MeshRepair, CutsWhereNoTwoTrianglesGoOnInEachOther) {
  // A fin on an edge of the box.
  TriangleMesh fin = test::box_mesh({1, 1, 1});
  fin.vertices.conservativeResize(3, 9);
  fin.vertices.col(8) << 0, -3, -3;
  fin.triangles.push_back({0, 1, 8});
  const RepairedMesh cut = repaired(fin);
  EXPECT_FALSE(cut.closed);
  EXPECT_EQ(cut.mesh.triangles.size(), 13u);
  EXPECT_TRUE(
      says(cut.warnings,
           "at 1 edge no two triangles go on in each other, the first where 3 meet from (-1, -1, -1) to (1, -1, -1)"))
      << cut.warnings[0];
  // A band of five quads with a half twist.
  TriangleMesh band;
  band.vertices.resize(3, 10);
  const int n = 5;
  for (int k = 0; k < n; ++k) {
    const double phi = 2 * M_PI * k / n;
    for (const int side : {0, 1}) {
      const double r = 1 + (side == 0 ? -0.3 : 0.3) * std::cos(phi / 2),
                   z = (side == 0 ? -0.3 : 0.3) * std::sin(phi / 2);
      band.vertices.col(2 * k + side) << r * std::cos(phi), r * std::sin(phi), z;
    }
    const int a = 2 * k, b = 2 * k + 1, c = k + 1 < n ? 2 * k + 2 : 1, d = k + 1 < n ? 2 * k + 3 : 0;
    band.triangles.push_back({a, b, c});
    band.triangles.push_back({b, d, c});
  }
  const RepairedMesh parted = repaired(band);
  EXPECT_TRUE(says(parted.warnings, "at 1 edge no two triangles")) << parted.warnings[0];
  EXPECT_TRUE(says(parted.warnings, "is open: 1 border"));
  EXPECT_EQ(parted.mesh.vertices.cols(), 12);
}

TEST(WindingNumber, IsOneInsideAndZeroOutside) {
  const TriangleMesh torus = test::torus_mesh(48, 24, 1, 0.3);
  const auto winding = [&](const Vector3d& p) { return winding_number(torus.vertices, torus.triangles, p); };
  EXPECT_NEAR(winding({1, 0, 0}), 1, 1e-12);
  EXPECT_NEAR(winding({0, -1, 0.2}), 1, 1e-12);
  EXPECT_NEAR(winding({0, 0, 0}), 0, 1e-12);
  EXPECT_NEAR(winding({1, 0, 0.4}), 0, 1e-12);
}

}  // namespace
}  // namespace toile
