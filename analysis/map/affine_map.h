// SPDX-License-Identifier: GPL-3.0-or-later
// The one affine map between what a scheme solves for and what a model sees: q = T x + g(t).
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <functional>
#include <vector>

#include "analysis/parallel/workers.h"

namespace toile {

// x: free nodes (xyz interleaved, 3 n_x numbers), q: control points (3 n_q). T acts on nodes, alike in x, y and z.
//   (1) rows of T sum to 1 for control points that no pin moves; for the others, together with their fixed part;
//   (2) fixed control points follow g(t).
class AffineMap {
 public:
  using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  // `dependence`: n_q x n_q; row i says how control point i follows the others: identity rows are independent; the rows
  // of extended functions and of control points that carry no cloth hold extension coefficients and refer to
  // independent control points only. `fixed`: control points held or moved, none twice; motion(i, t) is the place of
  // the i-th of them [m]. A fixed control point's own dependence row is ignored. Throws SolverError where this doesn't
  // hold.
  using Motion = std::function<Eigen::Vector3d(std::size_t, double)>;
  AffineMap(const Matrix& dependence, std::vector<int> fixed, Motion motion);

  static Matrix identity(int control_points);

  int control_points() const { return static_cast<int>(free_.rows()); }
  int nodes() const { return static_cast<int>(free_.cols()); }
  const Matrix& free_part() const { return free_; }         // T: n_q x n_x
  const Matrix& fixed_part() const { return fixed_part_; }  // G: n_q x n_fixed, g(t) = G (places of the fixed ones)
  const std::vector<int>& fixed() const { return fixed_; }
  const std::vector<int>& node_control_point() const { return node_control_point_; }  // control point that node k is
  // Control points from nodes and, behind them, fixed control points: [T G].
  Matrix all() const;
  Eigen::Matrix3Xd fixed_places(double t) const;
  void fixed_places(double t,
                    Eigen::Matrix3Xd& places) const;  // into memory that has the size already: allocates nothing

  void expand(const Eigen::Ref<const Eigen::VectorXd>& x, double t, Eigen::Ref<Eigen::VectorXd> q) const;
  // The same with the places of the fixed control points at hand; allocates nothing. Workers: the same bits.
  void expand(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Matrix3Xd& fixed_places,
              Eigen::Ref<Eigen::VectorXd> q, Workers* workers = nullptr) const;
  // T^T f for forces and other dual quantities (3 n_q -> 3 n_x), and for nodal scalars such as masses (n_q -> n_x).
  void reduce(const Eigen::Ref<const Eigen::VectorXd>& f, Eigen::Ref<Eigen::VectorXd> fx,
              Workers* workers = nullptr) const;
  Eigen::VectorXd reduce_scalar(const Eigen::Ref<const Eigen::VectorXd>& m) const;
  // x of a state q that satisfies the map (reads the node's own control points).
  Eigen::VectorXd restrict(const Eigen::Ref<const Eigen::VectorXd>& q) const;

 private:
  Matrix free_, transposed_, fixed_part_;
  std::vector<int> fixed_, node_control_point_;
  Motion motion_;
};

}  // namespace toile
