// SPDX-License-Identifier: GPL-3.0-or-later
// L D L^T of a sparse symmetric matrix that need not be positive, for equilibria beyond limit points.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>

#include "analysis/linear/cholesky.h"

namespace toile {

// Without pivoting: the order follows from the pattern alone, so that pivots near zero cost digits. Callers look at
// what is left of their equations.
class IndefiniteFactor {
 public:
  explicit IndefiniteFactor(SparsePattern pattern);
  ~IndefiniteFactor();

  // Values in the order of the pattern. How many eigenvalues are negative; nothing where a pivot is 0 or not finite.
  std::optional<int> factorise(std::span<const double> values);
  void solve(const Eigen::Ref<const Eigen::VectorXd>& rhs, Eigen::Ref<Eigen::VectorXd> x) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toile
