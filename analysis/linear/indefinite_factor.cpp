// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/linear/indefinite_factor.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <utility>

namespace toile {

struct IndefiniteFactor::Impl {
  Eigen::SparseMatrix<double> matrix;  // the lower triangle
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor;
};

IndefiniteFactor::IndefiniteFactor(SparsePattern pattern) : impl_(std::make_unique<Impl>()) {
  const std::vector<double> zeros(pattern.row.size(), 0.0);
  impl_->matrix = Eigen::Map<const Eigen::SparseMatrix<double>>(
      pattern.size(), pattern.size(), static_cast<Eigen::Index>(pattern.row.size()), pattern.column_start.data(),
      pattern.row.data(), zeros.data());
  impl_->factor.analyzePattern(impl_->matrix);
}
IndefiniteFactor::~IndefiniteFactor() = default;

std::optional<int> IndefiniteFactor::factorise(std::span<const double> values) {
  std::ranges::copy(values, impl_->matrix.valuePtr());
  impl_->factor.factorize(impl_->matrix);
  if (impl_->factor.info() != Eigen::Success || !impl_->factor.vectorD().allFinite()) return std::nullopt;
  return static_cast<int>((impl_->factor.vectorD().array() < 0).count());
}

void IndefiniteFactor::solve(const Eigen::Ref<const Eigen::VectorXd>& rhs, Eigen::Ref<Eigen::VectorXd> x) const {
  x = impl_->factor.solve(rhs);
}

}  // namespace toile
