// SPDX-License-Identifier: GPL-3.0-or-later
// What pulls two edges of cloth to each other before they are sewn.
#pragma once

#include <utility>
#include <vector>

#include "analysis/model/body.h"
#include "analysis/model/potential.h"

namespace toile {

struct SeamSpring {
  ScalarRow row;         // one place less the other
  double weight = 0;     // m of seam that it stands for
  double stiffness = 0;  // N/m2: per length of seam
  double slack = 0;      // m, up to which the places are free of each other
};

// Each stores weight h(|r| - slack), r what its row gives: h(s) = k s^2 / 2 up to the largest force, then linear, and 0
// below 0. They pull along the line between the places, which may turn on its way around a body.
class SeamSprings final : public Potential {
 public:
  // `force` [N/m] per length of seam, of each at most.
  SeamSprings(std::vector<SeamSpring> springs, double force);

  void set_slack(std::size_t spring, double slack) { springs_[spring].slack = slack; }
  const std::vector<SeamSpring>& springs() const { return springs_; }
  double energy(const Eigen::Ref<const Eigen::VectorXd>& q) const;                     // J
  double force(const Eigen::Ref<const Eigen::VectorXd>& q, std::size_t spring) const;  // N/m
  static constexpr const char* name = "seams";                                         // of the energy

  void add_force(const Eigen::Ref<const Eigen::VectorXd>& q, Eigen::Ref<Eigen::VectorXd> force, Elastic& elastic,
                 Workers* workers) const override;
  void add_force_change(const Eigen::Ref<const Eigen::VectorXd>& q, const Eigen::Ref<const Eigen::VectorXd>& dq,
                        Eigen::Ref<Eigen::VectorXd> df, TangentKind kind, Workers* workers) const override;
  std::vector<std::vector<int>> couplings() const override;
  std::vector<int> slots(const BlockPattern& pattern) const override;
  void add_hessian(const Eigen::Ref<const Eigen::VectorXd>& q, TangentKind kind, std::span<const int> slots,
                   BlockMatrix& matrix, Workers* workers) const override;

 private:
  struct Pull {
    double energy = 0, force = 0, slope = 0;  // of h: J/m, N/m, N/m2
  };
  Pull pull(const SeamSpring& spring, double length) const;
  // d2/dr2 of weight h, 0 where it is free.
  Eigen::Matrix3d hessian(const SeamSpring& spring, const Eigen::Vector3d& r) const;

  std::vector<SeamSpring> springs_;
  double most_;
};

}  // namespace toile
