// SPDX-License-Identifier: GPL-3.0-or-later
// A small draped scene as plain data: what a frame holds, without running anything.
#pragma once

#include <cmath>
#include <numbers>

#include "geometry/trimmed_surface.h"
#include "io/frame.h"

namespace toile::test {

// A hanging cloth of 1 m with folds that grow downwards, its net `n` x `n`, biquadratic, rational on demand; the
// material is the part with u below 0.8 (a straight trim), as triangles of a regular grid; strain_weft rises from `low`
// at the top to `high` at the hem.
struct Draped {
  TrimmedSurface face;
  NurbsSurface surface;
  TrimmedTriangles triangles;
  std::vector<ConstraintPoint> points;
  FramePanel panel;

  Draped(const Draped&) = delete;
  explicit Draped(bool rational = false, double low = 0.0, double high = 0.02, int n = 9) {
    constexpr double width = 0.8, pi = std::numbers::pi;
    const KnotVector knots = uniform_knots(2, n - 2);
    Eigen::Matrix3Xd flat(3, n * n), hanging(3, n * n);
    std::vector<double> weights;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const double a = knots.greville(i), b = knots.greville(j);
        flat.col(i + n * j) << a, b, 0;
        hanging.col(i + n * j) << 0.8 * a, 0.16 * (1 - b) * std::sin(5 * pi * a), b - 1 + 0.05 * a * a;
        if (rational) weights.push_back(1 + 0.4 * std::sin(3.0 * i + 7.0 * j));
      }
    face.name = "cloth";
    face.surface = NurbsSurface(knots, knots, flat, weights);
    surface = face.surface.with_points(hanging);
    TrimLoop loop;
    const Eigen::Vector2d corners[] = {{0, 0}, {width, 0}, {width, 1}, {0, 1}};
    for (int k = 0; k < 4; ++k)
      loop.curves.push_back({line_segment<2>(corners[k], corners[(k + 1) % 4]), k, false, {}});
    face.loops.push_back(loop);

    constexpr int cells = 70;
    for (int j = 0; j <= cells; ++j)
      for (int i = 0; i <= cells; ++i) triangles.uv.emplace_back(width * i / cells, double(j) / cells);
    for (int j = 0; j < cells; ++j)
      for (int i = 0; i < cells; ++i) {
        const int a = i + (cells + 1) * j, b = a + 1, c = a + cells + 2, d = a + cells + 1;
        triangles.triangles.push_back({a, b, c});
        triangles.triangles.push_back({a, c, d});
      }
    points.push_back({PointKind::vertex, knots[4], knots[4], -1, -1, 0, true, ""});
    points.push_back({PointKind::crossing_v, width, knots[4], 0, 1, knots[4], false, "redundant"});

    panel.name = "cloth";
    panel.surface = &surface;
    panel.face = &face;
    panel.triangles = &triangles;
    for (const Eigen::Vector2d& p : triangles.uv) {
      panel.fields.strain.emplace_back(low + (high - low) * (1 - p[1]), low, 0.1 * p[0]);
      panel.fields.curvature.emplace_back(p[0], p[1], 0);
      panel.fields.second_pk.emplace_back(11.7 * low, 11.7 * high, p[1]);
      panel.fields.nominal.emplace_back(p[0] * p[1], 2);
    }
    panel.velocity = hanging.colwise() - hanging.col(0);
    panel.carries_cloth.assign(static_cast<std::size_t>(n * n), true);
    panel.carries_cloth.back() = false;
    panel.points = points;
    panel.point_strain = {{0.01, 0.002}, {0.003, -0.001}};
    panel.point_stress = {{1, 2, 3, 4}, {-1, -2, -3, -4}};
  }
  Frame frame(int number = 0, double time = 0) const { return {number, time, {&panel, 1}}; }
};

}  // namespace toile::test
