// Laws of a display mesh over trimmed material.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <vector>

#include "support/near.h"
#include "trimming/topology.h"
#include "trimming/triangulation.h"

namespace toile::test {

inline double signed_area(const TrimmedTriangles& mesh, std::size_t k) {
  const auto& t = mesh.triangles[k];
  const Eigen::Vector2d a = mesh.uv[t[0]], b = mesh.uv[t[1]] - a, c = mesh.uv[t[2]] - a;
  return (b.x() * c.y() - b.y() * c.x()) / 2;
}

inline double area_of(const TrimmedTriangles& mesh) {
  double area = 0;
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) area += signed_area(mesh, k);
  return area;
}

// Edges of one triangle only, directed with it.
inline std::vector<std::array<int, 2>> boundary_edges(const TrimmedTriangles& mesh) {
  std::map<std::array<int, 2>, int> edges;
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  std::vector<std::array<int, 2>> boundary;
  for (const auto& [edge, count] : edges)
    if (!edges.contains({edge[1], edge[0]})) boundary.push_back(edge);
  return boundary;
}

//   (1) no two vertices in one place, every index valid, no vertex unused;
//   (2) triangles turn left, but for slivers at the rounding of their coordinates;
//   (3) every directed edge occurs once; the boundary edges close into loops;
//   (4) no triangle crosses a knot line;
//   (5) no vertex lies inside a boundary edge that runs along a knot line (no T-junction).
inline void expect_conforming(const TrimmedTriangles& mesh, const KnotMesh& knots) {
  std::map<std::pair<double, double>, int> places;
  for (const auto& p : mesh.uv) EXPECT_EQ(++places[std::make_pair(p.x(), p.y())], 1);
  std::vector<int> used(mesh.uv.size(), 0);
  std::map<std::array<int, 2>, int> edges;
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
    const auto& t = mesh.triangles[k];
    EXPECT_GE(signed_area(mesh, k), -1e-18);
    double u[2] = {HUGE_VAL, -HUGE_VAL}, v[2] = {HUGE_VAL, -HUGE_VAL};
    for (int c = 0; c < 3; ++c) {
      used[t[c]] = 1;
      ++edges[{t[c], t[(c + 1) % 3]}];
      const Eigen::Vector2d& p = mesh.uv[t[c]];
      u[0] = std::min(u[0], p.x());
      u[1] = std::max(u[1], p.x());
      v[0] = std::min(v[0], p.y());
      v[1] = std::max(v[1], p.y());
    }
    for (const double line : knots.u) EXPECT_FALSE(u[0] < line && line < u[1]) << line;
    for (const double line : knots.v) EXPECT_FALSE(v[0] < line && line < v[1]) << line;
  }
  for (const auto& [edge, count] : edges) EXPECT_EQ(count, 1);
  for (const int u : used) EXPECT_EQ(u, 1);
  std::map<int, int> balance;
  for (const auto& [a, b] : boundary_edges(mesh)) {
    ++balance[a];
    --balance[b];
    const Eigen::Vector2d &p = mesh.uv[a], &q = mesh.uv[b];
    for (int axis = 0; axis < 2; ++axis) {
      const auto& lines = axis == 0 ? knots.u : knots.v;
      if (p[axis] != q[axis] || std::find(lines.begin(), lines.end(), p[axis]) == lines.end()) continue;
      const double low = std::min(p[1 - axis], q[1 - axis]), high = std::max(p[1 - axis], q[1 - axis]);
      for (const auto& r : mesh.uv) EXPECT_FALSE(r[axis] == p[axis] && low < r[1 - axis] && r[1 - axis] < high);
    }
  }
  for (const auto& [vertex, sum] : balance) EXPECT_EQ(sum, 0);
}

}  // namespace toile::test
