// SPDX-License-Identifier: GPL-3.0-or-later
// The matrix of constraint rows over nodes, scale M + sum_r d_r^T d_r x B_r with a symmetric 3 x 3 block B_r for each
// row, and what else acts on the nodes: applied row by row, solved by conjugate gradients or by a factor.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "analysis/constraint/composed_rows.h"
#include "analysis/linear/block_matrix.h"
#include "analysis/linear/cholesky.h"
#include "analysis/linear/indefinite_factor.h"
#include "analysis/parallel/workers.h"

namespace toile {

struct SymmetricBlock {
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;

  // slope y y^T + tension I.
  static SymmetricBlock along(double slope, const double* y, double tension) {
    const double a = slope * y[0], b = slope * y[1], c = slope * y[2];
    return {a * y[0] + tension, b * y[1] + tension, c * y[2] + tension, a * y[1], a * y[2], b * y[2]};
  }
  bool zero() const { return xx == 0 && yy == 0 && zz == 0; }
  double trace() const { return xx + yy + zz; }
  Eigen::Vector3d operator*(const Eigen::Vector3d& v) const {
    return {xx * v[0] + xy * v[1] + xz * v[2], xy * v[0] + yy * v[1] + yz * v[2], xz * v[0] + yz * v[1] + zz * v[2]};
  }
};

// `rows` and `mass` must outlive it. The pattern is analysed in the constructor, once.
class RowMatrix {
 public:
  // `added`: pattern of a matrix over nodes that factors add; must outlive it. Null: none.
  RowMatrix(const CompressedRows& rows, const Eigen::VectorXd& mass, const BlockPattern* added = nullptr);

  double scale = 1;                    // of the masses
  std::vector<SymmetricBlock> blocks;  // one a row

  // to += D^T w, and out = D v, for a 3-vector each row; alike in x, y and z.
  void spread(const Eigen::Matrix3Xd& w, Eigen::Ref<Eigen::VectorXd> to) const;
  void gather(const Eigen::Ref<const Eigen::VectorXd>& v, Eigen::Matrix3Xd& out) const;

  // By a factor of the matrix as it is now: false where it is not positive. Then any number of solutions.
  bool factorise(const BlockMatrix* added = nullptr);
  // The same where it need not be positive: how many eigenvalues are negative; nothing where there is no factor.
  std::optional<int> factorise_any(const BlockMatrix* added = nullptr);
  void solve(const Eigen::VectorXd& rhs, Eigen::VectorXd& x) {
    positive_ ? factor_->solve(rhs, x) : indefinite_->solve(rhs, x);
  }
  // Conjugate gradients from x on with the nodes' own blocks as preconditioner, until the residual in the
  // preconditioner's norm is `tolerance` of the right side's; false where that takes more than `most` iterations. What
  // is left has no sum where rows feel no translation, so that momentum is kept exactly.
  bool conjugate_gradients(const Eigen::VectorXd& rhs, Eigen::VectorXd& x, double tolerance, int most);
  // How much the rows stiffen an average node: trace of sum d^2 B over scale m. Conjugate gradients slow down with it.
  double stiffening() const;

  void use_threads(Workers* workers);
  std::size_t factor_nonzeros() const { return factor_ ? factor_->factor_nonzeros() : 0; }

 private:
  void make_pattern(const BlockPattern* added);
  void fill(const BlockMatrix* added);
  void apply(const Eigen::VectorXd& v, Eigen::VectorXd& out);
  void invert_nodes();

  const CompressedRows* rows_;
  const Eigen::VectorXd* mass_;
  CompressedRows at_node_;  // D^T
  SparsePattern pattern_;
  std::vector<double> values_;
  // How many blocks below the diagonal's: of each pair of a row's entries (first <= second), of each block of `added`.
  std::vector<int> below_, added_below_;
  std::unique_ptr<Cholesky> factor_;
  std::unique_ptr<IndefiniteFactor> indefinite_;  // made where it is needed
  bool positive_ = true;                          // which of them holds the matrix
  bool free_ = true;                              // no row feels a translation
  Workers* workers_ = nullptr;

  std::vector<SymmetricBlock> inverse_;  // of each node's own block
  Eigen::VectorXd residual_, scaled_, direction_, image_;
  Eigen::Matrix3Xd of_row_;
};

// How far a row gives under a unit force if its nodes move each by itself, on `stiffness` of the node [N/m] and the
// largest diagonal entry of its block [m/N].
double own_compliance(const CompressedRows& rows, int row, const Eigen::VectorXd& stiffness, const BlockMatrix& blocks);

}  // namespace toile
