// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/seam/seam_springs.h"

#include <algorithm>

#include "analysis/linear/block_matrix.h"

namespace toile {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

SeamSprings::SeamSprings(std::vector<SeamSpring> springs, double force) : springs_(std::move(springs)), most_(force) {}

SeamSprings::Pull SeamSprings::pull(const SeamSpring& spring, double length) const {
  const double stretch = length - spring.slack, end = most_ / spring.stiffness;
  if (!(stretch > 0)) return {};
  if (stretch > end) return {most_ * (stretch - 0.5 * end), most_, 0};
  return {0.5 * spring.stiffness * stretch * stretch, spring.stiffness * stretch, spring.stiffness};
}

double SeamSprings::energy(const Eigen::Ref<const VectorXd>& q) const {
  double sum = 0;
  for (const SeamSpring& s : springs_) sum += s.weight * pull(s, apply(s.row, q).norm()).energy;
  return sum;
}

double SeamSprings::force(const Eigen::Ref<const VectorXd>& q, std::size_t spring) const {
  const SeamSpring& s = springs_[spring];
  return pull(s, apply(s.row, q).norm()).force;
}

void SeamSprings::add_force(const Eigen::Ref<const VectorXd>& q, Eigen::Ref<VectorXd> force, Elastic& elastic,
                            Workers*) const {
  double sum = 0;
  for (const SeamSpring& s : springs_) {
    const Vector3d r = apply(s.row, q);
    const double length = r.norm();
    const Pull p = pull(s, length);
    if (p.force == 0) continue;
    sum += s.weight * p.energy;
    const Vector3d along = s.weight * p.force / length * r;
    for (std::size_t k = 0; k < s.row.index.size(); ++k) force.segment<3>(3 * s.row.index[k]) -= s.row.value[k] * along;
  }
  elastic.energy.add(name, sum);
}

Matrix3d SeamSprings::hessian(const SeamSpring& spring, const Vector3d& r) const {
  const double length = r.norm();
  const Pull p = pull(spring, length);
  if (p.force == 0) return Matrix3d::Zero();
  const Vector3d n = r / length;
  const Matrix3d along = n * n.transpose();
  return spring.weight * (p.slope * along + p.force / length * (Matrix3d::Identity() - along));
}

// Convex for every slack >= 0: all kinds are the exact one.
void SeamSprings::add_force_change(const Eigen::Ref<const VectorXd>& q, const Eigen::Ref<const VectorXd>& dq,
                                   Eigen::Ref<VectorXd> df, TangentKind, Workers*) const {
  for (const SeamSpring& s : springs_) {
    const Vector3d change = hessian(s, apply(s.row, q)) * apply(s.row, dq);
    for (std::size_t k = 0; k < s.row.index.size(); ++k) df.segment<3>(3 * s.row.index[k]) -= s.row.value[k] * change;
  }
}

std::vector<std::vector<int>> SeamSprings::couplings() const {
  std::vector<std::vector<int>> out;
  for (const SeamSpring& s : springs_) out.push_back(s.row.index);
  return out;
}

std::vector<int> SeamSprings::slots(const BlockPattern& pattern) const {
  std::vector<int> out;
  for (const SeamSpring& s : springs_)
    for (std::size_t i = 0; i < s.row.index.size(); ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        const auto [low, high] = std::minmax(s.row.index[i], s.row.index[j]);
        out.push_back(pattern.slot(high, low));
      }
  return out;
}

void SeamSprings::add_hessian(const Eigen::Ref<const VectorXd>& q, TangentKind, std::span<const int> slots,
                              BlockMatrix& matrix, Workers*) const {
  std::size_t at = 0;
  for (const SeamSpring& s : springs_) {
    const Matrix3d h = hessian(s, apply(s.row, q));
    for (std::size_t i = 0; i < s.row.index.size(); ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> block(matrix.block(slots[at++]));
        block += s.row.value[i] * s.row.value[j] * h;
      }
  }
}

}  // namespace toile
