// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/constraint/composed_rows.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <string>

#include "geometry/error.h"

namespace toile {
namespace {

void append(CompressedRows& rows, const std::map<int, double>& entries) {
  for (const auto& [column, value] : entries) {
    if (value == 0) continue;
    rows.column.push_back(column);
    rows.value.push_back(value);
  }
  rows.start.push_back(static_cast<int>(rows.column.size()));
}

void append(ComposedRows& out, const AffineMap& map, const ScalarRow& row) {
  std::map<int, double> free, fixed;
  for (std::size_t k = 0; k < row.index.size(); ++k) {
    const int i = row.index[k];
    for (AffineMap::Matrix::InnerIterator e(map.free_part(), i); e; ++e)
      free[static_cast<int>(e.col())] += row.value[k] * e.value();
    for (AffineMap::Matrix::InnerIterator e(map.fixed_part(), i); e; ++e)
      fixed[static_cast<int>(e.col())] += row.value[k] * e.value();
  }
  append(out.free, free);
  append(out.fixed, fixed);
}

}  // namespace

ComposedRows compose(const AffineMap& map, const ConstraintRows& rows) {
  ComposedRows out;
  for (const StrainRow& row : rows.strain) append(out, map, row.row);
  for (const PlaceRow& row : rows.place) append(out, map, row.row);
  return out;
}

void evaluate(const ComposedRows& rows, const Eigen::Ref<const Eigen::VectorXd>& x,
              const Eigen::Matrix3Xd& fixed_places, int begin, int end, Eigen::Matrix3Xd& y) {
  const double* places = x.data();
  for (int r = begin; r < end; ++r) {
    double s0 = 0, s1 = 0, s2 = 0;
    for (int e = rows.free.start[r]; e < rows.free.start[r + 1]; ++e) {
      const double* p = places + 3 * rows.free.column[e];
      const double d = rows.free.value[e];
      s0 += d * p[0], s1 += d * p[1], s2 += d * p[2];
    }
    for (int e = rows.fixed.start[r]; e < rows.fixed.start[r + 1]; ++e) {
      const double* p = fixed_places.data() + 3 * rows.fixed.column[e];
      const double d = rows.fixed.value[e];
      s0 += d * p[0], s1 += d * p[1], s2 += d * p[2];
    }
    double* out = y.data() + 3 * r;
    out[0] = s0, out[1] = s1, out[2] = s2;
  }
}

CompressedRows transposed_by_mass(const CompressedRows& rows, const Eigen::VectorXd& node_mass) {
  CompressedRows out;
  out.start.assign(static_cast<std::size_t>(node_mass.size()) + 1, 0);
  for (int k : rows.column) ++out.start[k + 1];
  std::partial_sum(out.start.begin(), out.start.end(), out.start.begin());
  out.column.resize(rows.column.size());
  out.value.resize(rows.value.size());
  std::vector<int> next(out.start.begin(), out.start.end() - 1);
  for (int r = 0; r < rows.size(); ++r)
    for (int e = rows.start[r]; e < rows.start[r + 1]; ++e) {
      const int slot = next[rows.column[e]]++;
      out.column[slot] = r;
      out.value[slot] = rows.value[e] / node_mass[rows.column[e]];
    }
  return out;
}

Eigen::VectorXd gram_diagonal(const AffineMap& map, const ConstraintRows& rows, const ComposedRows& composed,
                              const Eigen::VectorXd& node_mass) {
  if (node_mass.size() != map.nodes()) throw SolverError("constraints: one mass per free node expected");
  for (int k = 0; k < node_mass.size(); ++k)
    if (!(node_mass[k] > 0))
      throw SolverError("constraints: control point " + std::to_string(map.node_control_point()[k]) + " has no mass");
  const CompressedRows& d = composed.free;
  Eigen::VectorXd out = Eigen::VectorXd::Zero(d.size());
  for (int r = 0; r < d.size(); ++r)
    for (int e = d.start[r]; e < d.start[r + 1]; ++e) out[r] += d.value[e] / node_mass[d.column[e]] * d.value[e];
  const auto strains = static_cast<Eigen::Index>(rows.strain.size());
  for (std::size_t p = 0; p < rows.place.size(); ++p)
    if (!(out[strains + static_cast<Eigen::Index>(p)] > 0))
      throw SolverError(name(rows.place[p]) +
                        " holds a point whose control points are all fixed by other pins: remove one of them");
  return out;
}

GramMatrix gram_matrix(const CompressedRows& rows, const Eigen::VectorXd& node_mass) {
  std::vector<std::vector<std::pair<int, double>>> rows_at(node_mass.size());  // ascending by construction
  for (int r = 0; r < rows.size(); ++r)
    for (int e = rows.start[r]; e < rows.start[r + 1]; ++e) rows_at[rows.column[e]].emplace_back(r, rows.value[e]);

  GramMatrix out;
  out.pattern.column_start.push_back(0);
  std::vector<double> sum(rows.size(), 0.0);
  std::vector<char> present(rows.size(), 0);
  std::vector<int> touched;
  for (int c = 0; c < rows.size(); ++c) {
    touched.assign(1, c);
    present[c] = 1;
    for (int e = rows.start[c]; e < rows.start[c + 1]; ++e) {
      const int k = rows.column[e];
      const double factor = rows.value[e] / node_mass[k];
      for (const auto& [r, d] : rows_at[k]) {
        if (r < c) continue;
        if (!present[r]) present[r] = 1, touched.push_back(r);
        sum[r] += factor * d;
      }
    }
    std::sort(touched.begin(), touched.end());
    for (int r : touched) {
      out.pattern.row.push_back(r);
      out.value.push_back(sum[r]);
      sum[r] = 0;
      present[r] = 0;
    }
    out.pattern.column_start.push_back(static_cast<int>(out.pattern.row.size()));
  }
  return out;
}

}  // namespace toile
