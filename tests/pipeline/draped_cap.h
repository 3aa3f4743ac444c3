// SPDX-License-Identifier: GPL-3.0-or-later
// A disc draped on a ball, as `toile drape` would write it: "cap flat" and "cap draped", millimetres.
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "geometry/nurbs_surface.h"
#include "geometry/trimmed_surface.h"
#include "io/panel_file.h"

namespace toile::test {

struct DrapedCap {
  double radius = 0.15;        // m, of the flat disc
  double ball = 0.15;          // m, radius
  double half_tangent = 0.55;  // tan(angle / 2), angle from the top to the rim
  double rim() const { return ball * 2 * half_tangent / (1 + half_tangent * half_tangent); }
};

// The ball is biquadratic by stereographic projection, (2 u, 2 v, 1 - u^2 - v^2) / (1 + u^2 + v^2).
inline PanelFile draped_cap(const DrapedCap& cap, const Eigen::Matrix3d& turned = Eigen::Matrix3d::Identity()) {
  constexpr double side = 0.6, mm = 1e3;
  const KnotVector knots = uniform_knots(2, 1, {-side, side});
  Eigen::Matrix3Xd flat(3, 9), draped(3, 9);
  std::vector<double> ones(9, 1), weights;
  const double first[] = {-side, 0, side}, square[] = {side * side, -side * side, side * side};  // Bezier: u, u^2
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      const double u = first[i], v = first[j], squares = square[i] + square[j], weight = 1 + squares;
      flat.col(3 * j + i) = mm * cap.radius / cap.half_tangent * Eigen::Vector3d(u, v, 0);
      draped.col(3 * j + i) = mm * cap.ball / weight * (turned * Eigen::Vector3d(2 * u, 2 * v, 1 - squares));
      weights.push_back(weight);
    }
  }
  TrimLoop loop;
  const Eigen::Vector2d ways[] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector2d from = cap.half_tangent * ways[k], to = cap.half_tangent * ways[(k + 1) % 4];
    Eigen::Matrix2Xd points(2, 3);
    points << from, from + to, to;
    TrimCurve trim;
    trim.curve = Curve2(uniform_knots(2, 1), points, std::vector<double>{1, std::sqrt(0.5), 1});
    trim.index = k;
    loop.curves.push_back(trim);
  }
  PanelFile file;
  file.path = "draped.igs";
  for (auto& [name, points, w] : {std::tuple("cap flat", flat, ones), std::tuple("cap draped", draped, weights)}) {
    TrimmedSurface face;
    face.surface = NurbsSurface(knots, knots, points, w);
    face.name = name;
    face.metres_per_unit = 1 / mm;
    face.natural_bounds = false;
    face.loops = {loop};
    file.panels.push_back(face);
  }
  return file;
}

}  // namespace toile::test
