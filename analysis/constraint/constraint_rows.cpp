// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/constraint/constraint_rows.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "analysis/constraint/row_areas.h"
#include "geometry/error.h"

namespace toile {
namespace {

// Values of exact zeros come out as rounding of the largest.
constexpr double zero = 1e-13;

ScalarRow make_row(const MaterialPoint& point, int which) {
  const std::vector<double>& value = point.value[which];
  double largest = 0;
  for (double d : value) largest = std::max(largest, std::abs(d));
  std::vector<int> order(value.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return point.index[a] < point.index[b]; });
  ScalarRow row;
  for (int k : order) {
    if (std::abs(value[k]) <= zero * largest) continue;
    row.index.push_back(point.index[k]);
    row.value.push_back(value[k]);
  }
  return row;
}

}  // namespace

std::string name(const PlaceRow& row) {
  return row.seam >= 0 ? "seam " + std::to_string(row.seam) : "pin " + std::to_string(row.pin);
}

void require_whole_places(const ConstraintRows& rows, const std::string& remedy) {
  for (const PlaceRow& row : rows.place)
    if (row.axes != Eigen::Vector3d::Ones())
      throw SolverError(name(row) + " holds some components only (hold): " + remedy);
}

std::vector<StrainRow> strain_rows(const Body& body, const AffineMap& map,
                                   const std::vector<std::vector<ConstraintPoint>>& points) {
  std::vector<StrainRow> rows;
  std::vector<ScalarRow> values;
  for (int panel = 0; panel < static_cast<int>(points.size()); ++panel)
    for (int k = 0; k < static_cast<int>(points[panel].size()); ++k) {
      const ConstraintPoint& point = points[panel][k];
      if (!point.used) continue;
      const MaterialPoint functions = body.material_point(panel, point.u, point.v);
      const Eigen::Vector2d uv(point.u, point.v);
      rows.push_back({make_row(functions, 1), panel, k, false, 0, 0, uv, {1, 0}});
      rows.push_back({make_row(functions, 2), panel, k, true, 0, 0, uv, {0, 1}});
      values.insert(values.end(), 2, make_row(functions, 0));
    }
  weigh_rows(body, map, values, rows);
  return rows;
}

}  // namespace toile
