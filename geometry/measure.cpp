// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/measure.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "geometry/grid_evaluation.h"
#include "geometry/quadrature_rule.h"

namespace toile {

template <int Dim>
Eigen::AlignedBox<double, Dim> bounding_box(const NurbsCurve<Dim>& curve) {
  return {curve.points().rowwise().minCoeff(), curve.points().rowwise().maxCoeff()};
}

Eigen::AlignedBox3d bounding_box(const NurbsSurface& surface) {
  return {surface.points().rowwise().minCoeff(), surface.points().rowwise().maxCoeff()};
}

namespace {

struct Cell {
  int span_u, span_v;
  Interval u, v;
};

// The 8 x 8 Gauss rule.
double cell_area(const NurbsSurface& surface, const Cell& cell) {
  const auto node = [](Interval range, int k) {
    const double x = gauss8_x[k / 2];
    return range.min + range.length() / 2 * (1 + (k % 2 == 0 ? -x : x));
  };
  std::array<Eigen::Vector2d, 64> points;
  std::array<SurfaceJet, 64> jets;
  for (int j = 0; j < 8; ++j)
    for (int i = 0; i < 8; ++i) points[i + 8 * j] << node(cell.u, i), node(cell.v, j);
  evaluate_on_span(surface, cell.span_u, cell.span_v, points, jets);
  double sum = 0;
  for (std::size_t k = 0; k < 64; ++k) sum += gauss8_w[k % 8 / 2] * gauss8_w[k / 16] * jets[k].area_scale();
  return sum * cell.u.length() * cell.v.length() / 4;
}

// Halved in both directions until the rule agrees with its refinement. The depth is met only where the surface is
// singular, on cells that no longer count.
double refined_area(const NurbsSurface& surface, const Cell& cell, double whole, double tolerance, int depth) {
  const double mu = cell.u.min + cell.u.length() / 2, mv = cell.v.min + cell.v.length() / 2;
  std::array<Cell, 4> parts = {Cell{cell.span_u, cell.span_v, {cell.u.min, mu}, {cell.v.min, mv}},
                               Cell{cell.span_u, cell.span_v, {mu, cell.u.max}, {cell.v.min, mv}},
                               Cell{cell.span_u, cell.span_v, {cell.u.min, mu}, {mv, cell.v.max}},
                               Cell{cell.span_u, cell.span_v, {mu, cell.u.max}, {mv, cell.v.max}}};
  std::array<double, 4> areas;
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) sum += areas[k] = cell_area(surface, parts[k]);
  if (std::abs(sum - whole) <= tolerance || depth >= 20) return sum;
  double result = 0;
  for (std::size_t k = 0; k < 4; ++k) result += refined_area(surface, parts[k], areas[k], tolerance / 4, depth + 1);
  return result;
}

}  // namespace

double surface_area(const NurbsSurface& surface, double relative_tolerance) {
  std::vector<Cell> cells;
  for (int sv : surface.v().spans())
    for (int su : surface.u().spans())
      cells.push_back({su, sv, {surface.u()[su], surface.u()[su + 1]}, {surface.v()[sv], surface.v()[sv + 1]}});
  std::vector<double> first(cells.size());
  double estimate = 0;
  for (std::size_t k = 0; k < cells.size(); ++k) estimate += first[k] = cell_area(surface, cells[k]);
  const double tolerance = std::max(relative_tolerance, 1e-15) * estimate / static_cast<double>(cells.size());
  double area = 0;
  for (std::size_t k = 0; k < cells.size(); ++k) area += refined_area(surface, cells[k], first[k], tolerance, 0);
  return area;
}

template Eigen::AlignedBox<double, 2> bounding_box(const NurbsCurve<2>&);
template Eigen::AlignedBox<double, 3> bounding_box(const NurbsCurve<3>&);

std::optional<Eigen::Vector3d> mean_u_direction(const NurbsSurface& surface, double flatness) {
  constexpr int lines = 32;             // of constant v, whose chords are averaged
  constexpr double least_chord = 0.05;  // of the lines' length
  const Eigen::Matrix3Xd spread = surface.points().colwise() - surface.points().rowwise().mean();
  const Eigen::Vector3d normal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread * spread.transpose()).eigenvectors().col(0);
  const double size = spread.colwise().norm().maxCoeff();
  if (!((normal.transpose() * spread).cwiseAbs().maxCoeff() <= flatness * size)) return std::nullopt;

  const Interval u = surface.u().domain(), v = surface.v().domain();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double length = 0;
  for (int k = 0; k < lines; ++k) {
    const double at = v.min + v.length() * (k + 0.5) / lines;
    Eigen::Vector3d last = surface(u.min, at);
    for (int i = 1; i <= lines; ++i) {
      const Eigen::Vector3d next = surface(i == lines ? u.max : u.min + u.length() * i / lines, at);
      mean += next - last;
      length += (next - last).norm();
      last = next;
    }
  }
  if (!(mean.norm() > least_chord * length)) return std::nullopt;
  return mean.normalized();
}

}  // namespace toile
