// SPDX-License-Identifier: GPL-3.0-or-later
// The whole stress of cloth whose strain is limited: what the fabric carries and what the limit does. [Peng & Zheng
// 2022, 3.5, eq. 37]
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "analysis/constraint/constraint_rows.h"

namespace toile {

// Along one thread [N/m].
struct ThreadStress {
  double second_pk = 0, nominal = 0;
};

// Eq. 37 as it stands, per strain row: the fabric's stress at the row's place plus lambda / area. `row_force`: size of
// each row's force [N m], above 0 where it pulls: the strain impulses of a step of FastProjection over dt^2, which are
// lambda times the stretch along which they acted. A multiplier is the stress times the quadrature weight that
// equilibrium gives the row (2/3 and 4/3 of a cell in turns at p = 2): over an area that is no such weight it has
// stripes. weigh_rows() makes it one as far as weights can be.
std::vector<ThreadStress> row_stress(const Body& body, const ConstraintRows& rows,
                                     const Eigen::Ref<const Eigen::VectorXd>& row_force,
                                     const Eigen::Ref<const Eigen::VectorXd>& q);

// Smoothed: each control point takes the mean of the rows under its function, by function and area, weft and warp each;
// the functions sum them up. What stripes are left is averaged away.
//   (1) a uniform stress of the rows stays uniform; (2) no value lies outside those of the rows;
//   (3) springs on a net turned against the threads, and diagonal ones, count for the thread that is nearer.
class StressField {
 public:
  StressField(const Body& body, const ConstraintRows& rows, const std::vector<ThreadStress>& stress);
  // Weft, warp at a material point; the fabric's own at q where no control point around has a row.
  std::array<ThreadStress, 2> at(int panel, double u, double v, const Eigen::Ref<const Eigen::VectorXd>& q) const;

 private:
  const Body& body_;
  // Per direction and control point of all panels: sum of weights, and the weighted stresses.
  std::array<Eigen::Matrix3Xd, 2> sums_;
};

}  // namespace toile
