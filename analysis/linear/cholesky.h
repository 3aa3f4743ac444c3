// SPDX-License-Identifier: GPL-3.0-or-later
// Sparse symmetric positive definite systems with a fixed pattern, analysed once, refactored at will: by an envelope
// where its rows are short, else by supernodes in nested dissection.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "analysis/parallel/workers.h"

namespace toile {

// Lower triangle in compressed columns: column_start n+1, row indices ascending within a column, diagonal present.
struct SparsePattern {
  std::vector<int> column_start, row;
  int size() const { return static_cast<int>(column_start.size()) - 1; }
};

// Whose numbers a factor has. CHOLMOD is the reference for ours: the tests compare the two, and the build option
// TOILE_CHOLMOD_SOLVES makes it the default, to tell a fault of the factor from one of the matrix.
enum class CholeskyNumbers { ours, cholmod };
CholeskyNumbers default_numbers();

class Cholesky {
 public:
  explicit Cholesky(SparsePattern pattern, CholeskyNumbers numbers = default_numbers());
  ~Cholesky();
  Cholesky(Cholesky&&) noexcept;
  Cholesky& operator=(Cholesky&&) noexcept;

  // Values in the order of the pattern. False where a pivot is not positive; the factor is then unusable.
  bool factorise(std::span<const double> values);
  // Not const: it works in memory of the factor's own, so one call at a time.
  void solve(const Eigen::Ref<const Eigen::VectorXd>& rhs, Eigen::Ref<Eigen::VectorXd> x);
  // Supernodes are shared out among these, with the same bits.
  void use_threads(Workers* workers);
  std::size_t factor_nonzeros() const;
  double factor_operations() const;  // floating-point, of one factorisation

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toile
