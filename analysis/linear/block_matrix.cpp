// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/linear/block_matrix.h"

#include <algorithm>
#include <cassert>
#include <stdexcept>
#include <string>

namespace toile {

BlockPattern::BlockPattern(int points, const std::vector<std::vector<int>>& groups) {
  std::vector<std::vector<int>> columns(static_cast<std::size_t>(points));
  for (int p = 0; p < points; ++p) columns[static_cast<std::size_t>(p)].push_back(p);
  for (const std::vector<int>& group : groups)
    for (const int column : group)
      for (const int row : group)
        if (row > column) columns[static_cast<std::size_t>(column)].push_back(row);
  column_start_.reserve(columns.size() + 1);
  column_start_.push_back(0);
  for (std::vector<int>& column : columns) {
    std::ranges::sort(column);
    row_.insert(row_.end(), column.begin(), std::unique(column.begin(), column.end()));
    column_start_.push_back(static_cast<int>(row_.size()));
    column = {};
  }
}

int BlockPattern::slot(int row, int column) const {
  const std::span<const int> of = rows(column);
  const auto it = std::ranges::lower_bound(of, row);
  if (it == of.end() || *it != row)
    throw std::out_of_range("points " + std::to_string(row) + " and " + std::to_string(column) + " have no block");
  return first_slot(column) + static_cast<int>(it - of.begin());
}

SparsePattern BlockPattern::scalars() const {
  SparsePattern out;
  out.column_start.push_back(0);
  for (int column = 0; column < points(); ++column)
    for (int c = 0; c < 3; ++c) {
      for (const int row : rows(column))
        for (int r = row == column ? c : 0; r < 3; ++r) out.row.push_back(3 * row + r);
      out.column_start.push_back(static_cast<int>(out.row.size()));
    }
  return out;
}

BlockMatrix::BlockMatrix(const BlockPattern& pattern)
    : pattern_(&pattern), values_(9 * static_cast<std::size_t>(pattern.blocks()), 0.0) {}

void BlockMatrix::set_zero() {
  std::ranges::fill(values_, 0.0);
}

void BlockMatrix::multiply(const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Ref<Eigen::VectorXd> y) const {
  using Block = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>;
  assert(x.size() == 3 * pattern_->points() && y.size() == x.size());
  y.setZero();
  for (int column = 0; column < pattern_->points(); ++column) {
    int slot = pattern_->first_slot(column);
    for (const int row : pattern_->rows(column)) {
      const Block a(block(slot++));
      if (row == column) {
        y.segment<3>(3 * row) += a.selfadjointView<Eigen::Lower>() * x.segment<3>(3 * row);
      } else {
        y.segment<3>(3 * row) += a * x.segment<3>(3 * column);
        y.segment<3>(3 * column) += a.transpose() * x.segment<3>(3 * row);
      }
    }
  }
}

void BlockMatrix::write(std::span<double> values) const {
  std::size_t k = 0;
  for (int column = 0; column < pattern_->points(); ++column)
    for (int c = 0; c < 3; ++c) {
      int slot = pattern_->first_slot(column);
      for (const int row : pattern_->rows(column)) {
        const double* a = block(slot++);
        for (int r = row == column ? c : 0; r < 3; ++r) values[k++] = a[3 * r + c];
      }
    }
  assert(k == values.size());
}

}  // namespace toile
