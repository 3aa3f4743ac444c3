// SPDX-License-Identifier: GPL-3.0-or-later
// Bezier spans of trim curves: the curves that every decision of trimming/ is about.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "geometry/trimmed_surface.h"

namespace toile {

// One polynomial or rational Bezier piece of a trim curve, Euclidean control points, weights > 0.
//   (1) s in [0, 1] maps to t = range.min + s * range.length();
//   (2) neighbours on one curve share their end point bitwise;
//   (3) where the curve's knots are Bezier knots already, the points are the curve's own doubles; else they come from
//       one extraction in twice the precision, rounded once: control points that share a coordinate give points that
//       share it;
//   (4) every number is finite (trim_spans() throws GeometryError where the extraction overflows).
struct TrimSpan {
  int loop = 0, curve = 0;  // positions in TrimmedSurface::loops and TrimLoop::curves
  Interval range;           // parameters of the curve as given
  int degree = 1;
  std::array<double, max_degree + 1> u, v, w;

  Eigen::Vector2d point(int i) const { return {u[static_cast<std::size_t>(i)], v[static_cast<std::size_t>(i)]}; }
  Eigen::Vector2d first() const { return point(0); }
  Eigen::Vector2d last() const { return point(degree); }
  double t(double s) const;  // range.min and range.max bitwise at 0 and 1
  // Position at s in [0, 1].
  Eigen::Vector2d at(double s) const;
  bool degenerate() const;  // all control points equal
};

// All spans of a surface's trims: curve by curve in loop order, ascending t on each curve.
struct TrimSpans {
  std::vector<TrimSpan> all;
  std::vector<std::vector<int>> first;  // first[loop][curve], one more entry at the end of each loop
  std::span<const TrimSpan> of(int loop, int curve) const;
  std::span<const TrimSpan> of(int loop) const;
};

std::vector<TrimSpan> trim_spans(const Curve2& curve, int loop = 0, int curve_position = 0);
TrimSpans trim_spans(const std::vector<TrimLoop>& loops);

// Does the loop run against the file's order of its curves (against the direction of a single one)?
bool against_the_file(const TrimLoop& loop);

}  // namespace toile
