// SPDX-License-Identifier: GPL-3.0-or-later
// Closed bodies of triangles, facing outwards [m].
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace toile::test {

inline TriangleMesh box_mesh(const Eigen::Vector3d& half) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 8);
  for (int k = 0; k < 8; ++k)
    mesh.vertices.col(k) = half.cwiseProduct(Eigen::Vector3d(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

// A ball with `rings` circles between its poles, of 2 (rings + 1) points each, and its radius as a function of the
// direction.
inline TriangleMesh ball_mesh(int rings, const std::function<double(const Eigen::Vector3d&)>& radius) {
  TriangleMesh mesh;
  const int around = 2 * (rings + 1);
  mesh.vertices.resize(3, rings * around + 2);
  const auto direction = [&](int i, double j) {
    const double theta = std::numbers::pi * (i + 1) / (rings + 1), phi = 2 * std::numbers::pi * j / around;
    return Eigen::Vector3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
  };
  const auto at = [&](int i, int j) { return i * around + j % around; };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < around; ++j) mesh.vertices.col(at(i, j)) = radius(direction(i, j)) * direction(i, j);
  const int north = rings * around, south = north + 1;
  mesh.vertices.col(north) = radius(Eigen::Vector3d::UnitZ()) * Eigen::Vector3d::UnitZ();
  mesh.vertices.col(south) = -radius(-Eigen::Vector3d::UnitZ()) * Eigen::Vector3d::UnitZ();
  for (int j = 0; j < around; ++j) {
    mesh.triangles.push_back({north, at(0, j), at(0, j + 1)});
    mesh.triangles.push_back({south, at(rings - 1, j + 1), at(rings - 1, j)});
    for (int i = 0; i + 1 < rings; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return mesh;
}

inline TriangleMesh sphere_mesh(int rings, double radius) {
  return ball_mesh(rings, [=](const Eigen::Vector3d&) { return radius; });
}

// Long spikes and deep dents.
inline TriangleMesh spiky_mesh(int rings) {
  return ball_mesh(rings, [](const Eigen::Vector3d& d) {
    return 0.5 + 0.35 * std::sin(7 * d.x()) * std::sin(8 * d.y() + 1) * std::cos(9 * d.z());
  });
}

// Around z; n and m points the long and the short way.
inline TriangleMesh torus_mesh(int n, int m, double large, double small) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, n * m);
  const auto at = [&](int i, int j) { return (i % n) * m + j % m; };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < m; ++j) {
      const double u = 2 * std::numbers::pi * i / n, v = 2 * std::numbers::pi * j / m;
      const double r = large + small * std::cos(v);
      mesh.vertices.col(at(i, j)) << r * std::cos(u), r * std::sin(u), small * std::sin(v);
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

inline double volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d x = mesh.vertices.col(a), y = mesh.vertices.col(b), z = mesh.vertices.col(c);
    sum += x.dot(y.cross(z)) / 6;
  }
  return sum;
}

}  // namespace toile::test
