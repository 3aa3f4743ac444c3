// SPDX-License-Identifier: GPL-3.0-or-later
// Elastic energy, loads and drag of a system over its nodes, at one time, with their Hessian.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/projection/primal_dual.h"
#include "analysis/scheme/reduced_matrix.h"
#include "analysis/scheme/verlet.h"

namespace toile {

// The system must outlive it.
class NodeForces final : public SmoothEnergy {
 public:
  explicit NodeForces(const MechanicalSystem& system);
  const BlockPattern& pattern() const { return reduced_.pattern(); }

  double load_factor = 1;
  // Drag sees the velocity (x - from) / beta.
  void at(double t, const Eigen::VectorXd& from, double beta);
  const Eigen::Matrix3Xd& fixed_places() const { return fixed_places_; }

  double value(const Eigen::Ref<const Eigen::VectorXd>& x) override;
  void add_gradient(const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::VectorXd& g) override;
  const BlockMatrix& hessian(const Eigen::Ref<const Eigen::VectorXd>& x, bool positive) override;

 private:
  // Control points and forces on them without drag, in q_ and f_, and what the potentials store.
  Elastic force(const Eigen::Ref<const Eigen::VectorXd>& x);
  Eigen::Vector3d velocity(const Eigen::Ref<const Eigen::VectorXd>& x, int k) const {
    return (x.segment<3>(3 * k) - from_.segment<3>(3 * k)) / beta_;
  }

  const MechanicalSystem& system_;
  BlockPattern pattern_;
  ReducedMatrix reduced_;
  BlockMatrix points_, nodes_;
  std::vector<std::vector<int>> slots_;
  Eigen::Matrix3Xd fixed_places_;
  Eigen::VectorXd q_, f_, of_nodes_, from_;
  double beta_ = 1;
};

}  // namespace toile
