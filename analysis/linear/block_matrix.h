// SPDX-License-Identifier: GPL-3.0-or-later
// Symmetric sparse matrices of 3 x 3 blocks, one for each pair of points that act on each other. The pattern is made
// once, from groups of points; values are assembled into fixed slots at will.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "analysis/linear/cholesky.h"

namespace toile {

// Lower triangle by block columns: rows ascending, the diagonal first.
class BlockPattern {
 public:
  // `groups`: points that all act on each other, such as the functions of a cell. Every point has its diagonal block.
  BlockPattern(int points, const std::vector<std::vector<int>>& groups);

  int points() const { return static_cast<int>(column_start_.size()) - 1; }
  int blocks() const { return static_cast<int>(row_.size()); }
  // Of the block (row, column), row >= column. Throws std::out_of_range where the pattern has none.
  int slot(int row, int column) const;
  // Rows of the blocks of a column.
  std::span<const int> rows(int column) const {
    return std::span(row_).subspan(static_cast<std::size_t>(column_start_[column]),
                                   static_cast<std::size_t>(column_start_[column + 1] - column_start_[column]));
  }
  int first_slot(int column) const { return column_start_[column]; }
  // The same lower triangle by scalar unknowns, xyz interleaved.
  SparsePattern scalars() const;

 private:
  std::vector<int> column_start_, row_;
};

// Values on a pattern, which must outlive it.
class BlockMatrix {
 public:
  explicit BlockMatrix(const BlockPattern& pattern);

  void set_zero();
  // Nine numbers, row by row.
  double* block(int slot) { return values_.data() + 9 * static_cast<std::ptrdiff_t>(slot); }
  const double* block(int slot) const { return values_.data() + 9 * static_cast<std::ptrdiff_t>(slot); }
  // y = A x; 3 n numbers each. Of diagonal blocks the lower triangle counts.
  void multiply(const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Ref<Eigen::VectorXd> y) const;
  // In the order of BlockPattern::scalars().
  void write(std::span<double> values) const;

  const BlockPattern& pattern() const { return *pattern_; }

 private:
  const BlockPattern* pattern_;
  std::vector<double> values_;
};

}  // namespace toile
