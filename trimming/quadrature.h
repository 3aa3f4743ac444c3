// SPDX-License-Identifier: GPL-3.0-or-later
// Quadrature over the material of a trimmed surface in its parameter plane.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "trimming/topology.h"

namespace toile {

// Points of one cell: [first, first + count) in CutQuadrature. Outside cells have no entry.
struct CellRule {
  int i = 0, j = 0;
  int first = 0, count = 0;
  bool tensor = false;      // Gauss points, u fastest: the cell is uncut
  double area = 0;          // exact area of its material in the parameter plane (sum of weights)
  double cut_fraction = 1;  // area over the cell's area
};

//   (1) every point lies in the material of its cell; every weight is positive;
//   (2) uncut cells: (p_u + 1) x (p_v + 1) Gauss points, fewer where asked;
//   (3) cut cells: u^a v^b integrated exactly for a <= degree_u, b <= degree_v (relative 1e-12 of the cell's moments
//       for polynomial trims; rational trims to rounding) with at most (degree_u + 1)(degree_v + 1) points;
//   (4) cells ordered by mesh.cell.
struct CutQuadrature {
  std::vector<CellRule> cells;
  std::vector<Eigen::Vector2d> points;
  std::vector<double> weights;  // parameter area
  double area = 0;              // of the material, parameter plane
  double moment_residual = 0;   // largest relative moment error over all cut cells
};

struct QuadratureOptions {
  std::optional<int> degree_u, degree_v;  // exactness on cut cells; unset: twice the surface's degree
  std::optional<int> gauss_u, gauss_v;    // points per direction on uncut cells; unset: degree + 1
  // One point less in a direction in which the functions go on smoothly (C1) into another uncut cell, at least half as
  // long. A cell for itself has more functions than that, and some would move without being seen.
  bool one_less = false;
};
CutQuadrature quadrature(const TrimmedSurface& surface, const TrimTopology& topology, const QuadratureOptions& = {});
// The same in one call: loops validated as validate_loops() does, traced, integrated. Throws what that throws.
CutQuadrature quadrature(TrimmedSurface surface, const QuadratureOptions& options = {});

// Area [unit of the net squared] of the trimmed surface and length [unit of the net] of its loops in space.
struct PanelMeasure {
  double area = 0;
  std::vector<double> loop_lengths;
};
PanelMeasure measure(const TrimmedSurface& surface, const TrimTopology& topology);

}  // namespace toile
