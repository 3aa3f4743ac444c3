#include "analysis/projection/constraint_rows.h"

#include <algorithm>
#include <cmath>
#include <numeric>

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

std::vector<StrainRow> strain_rows(const ShellModel& model, const std::vector<std::vector<ConstraintPoint>>& points,
                                   const Eigen::VectorXd& mass) {
  std::vector<StrainRow> rows;
  for (int panel = 0; panel < static_cast<int>(points.size()); ++panel)
    for (int k = 0; k < static_cast<int>(points[panel].size()); ++k) {
      const ConstraintPoint& point = points[panel][k];
      if (!point.used) continue;
      const MaterialPoint functions = model.material_point(panel, point.u, point.v);
      double area = 0;
      for (std::size_t i = 0; i < functions.index.size(); ++i) area += functions.value[0][i] * mass[functions.index[i]];
      area /= model.panels()[panel].fabric.density;
      rows.push_back({make_row(functions, 1), panel, k, false, area});
      rows.push_back({make_row(functions, 2), panel, k, true, area});
    }
  return rows;
}

ScalarRow place_row(const ShellModel& model, int panel, double u, double v) {
  return make_row(model.material_point(panel, u, v), 0);
}

}  // namespace toile
