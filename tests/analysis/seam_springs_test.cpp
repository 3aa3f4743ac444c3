// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/seam/seam_springs.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "analysis/linear/block_matrix.h"

namespace toile {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

// Free, within the quadratic part, beyond it.
SeamSprings springs() {
  return SeamSprings({{{{0, 1, 2}, {0.4, 0.6, -1.0}}, 0.02, 10, 5.0},
                      {{{1, 3, 4, 5}, {1.0, -0.2, -0.5, -0.3}}, 0.03, 12, 0.1},
                      {{{0, 5}, {1.0, -1.0}}, 0.01, 10, 0.2}},
                     5);
}
VectorXd places() {
  VectorXd q(18);
  q << 0.1, 0.2, 0.3, 0.4, -0.1, 0.2, 0.5, 0.6, -0.3, 0.2, 0.1, 0.15, 0.3, 0.05, 0.1, 1.2, -0.9, 0.4;
  return q;
}
VectorXd force_at(const SeamSprings& s, const VectorXd& q, double* energy = nullptr) {
  VectorXd f = VectorXd::Zero(q.size());
  Elastic elastic;
  s.add_force(q, f, elastic, nullptr);
  if (energy) *energy = elastic.energy.of(SeamSprings::name);
  return f;
}

TEST(SeamSprings, PullWithABoundedForceAlongTheLineBetween) {
  const SeamSprings s = springs();
  const VectorXd q = places();
  EXPECT_EQ(s.force(q, 0), 0);
  EXPECT_GT(s.force(q, 1), 0);
  EXPECT_LT(s.force(q, 1), 5);
  EXPECT_EQ(s.force(q, 2), 5);
  const VectorXd f = force_at(s, q);
  const Vector3d between = q.segment<3>(0) - q.segment<3>(15);
  // Point 0 has the third spring alone.
  EXPECT_LT((f.segment<3>(0) + 0.01 * 5 * between.normalized()).norm(), 1e-15);
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < 6; ++k) sum += f.segment<3>(3 * k);
  EXPECT_LT(sum.norm(), 1e-15);
}

TEST(SeamSprings, ForceAndHessianAreDerivatives) {
  const SeamSprings s = springs();
  const VectorXd q = places();
  const double h = 1e-6;
  const BlockPattern pattern(6, s.couplings());
  BlockMatrix matrix(pattern);
  matrix.set_zero();
  s.add_hessian(q, TangentKind::exact, s.slots(pattern), matrix, nullptr);
  const VectorXd f = force_at(s, q);
  for (int i = 0; i < q.size(); ++i) {
    VectorXd up = q, down = q;
    up[i] += h, down[i] -= h;
    double above = 0, below = 0;
    const VectorXd change = (force_at(s, up, &above) - force_at(s, down, &below)) / (2 * h);
    EXPECT_NEAR(f[i], -(above - below) / (2 * h), 1e-9);
    VectorXd df = VectorXd::Zero(q.size()), product(q.size());
    const VectorXd unit = VectorXd::Unit(q.size(), i);
    s.add_force_change(q, unit, df, TangentKind::exact, nullptr);
    EXPECT_LT((df - change).norm(), 1e-8);
    matrix.multiply(unit, product);
    EXPECT_LT((product + df).norm(), 1e-14);
  }
}

TEST(SeamSprings, ARigidMotionChangesNothing) {
  const SeamSprings s = springs();
  const VectorXd q = places();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  VectorXd moved(q.size());
  for (int k = 0; k < 6; ++k) moved.segment<3>(3 * k) = turn * q.segment<3>(3 * k) + Vector3d(1, -2, 0.5);
  EXPECT_NEAR(s.energy(q), s.energy(moved), 1e-14);
}

}  // namespace
}  // namespace toile
