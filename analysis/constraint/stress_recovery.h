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
// equilibrium gives the row (alternately 2/3 and 4/3 of a cell at p = 2): divided by an area that is no such weight it
// shows stripes. weigh_rows() makes the areas such weights as far as that is possible.
std::vector<ThreadStress> row_stress(const Body& body, const ConstraintRows& rows,
                                     const Eigen::Ref<const Eigen::VectorXd>& row_force,
                                     const Eigen::Ref<const Eigen::VectorXd>& q);

// The field that holds the nodes where the membrane's forces do: the fabric's and the limit's together. S in the nodes'
// functions (weft, warp and shear; pins ignored) makes least
//   |A S + B r - f|^2 / h^2 + smoothing (integral |grad S|^2 + shear / h^2 integral (S12 - fabric's)^2
//                                        + rows / h^2 sum area (S along the row's thread - row_stress())^2)
// where f are the forces on free nodes, A S those of a stress S (by the model's quadrature; y1, y2: threads at q)
//   (A S)_I = - integral of S1 y1 N_I,1 + S2 y2 N_I,2 + S12 (y1 N_I,2 + y2 N_I,1),
// B r what place rows may take up along the axes that they hold, unknown, and h^2 the median of the nodes' areas.
// Forces on nodes are right however the limit divides a load among its rows; the shear and the rows decide where pins
// hold both ends of a thread.
//   (1) a uniform stress comes back as it is; (2) what place rows and fixed control points take up changes nothing, a
//   row that holds some axes along these alone; (3) nor do the areas of the rows, but for what forces leave open.
// Peaks of a few cells' width are smoothed, at points pinned alone and beside small holes.
class StressField {
 public:
  struct Options {
    double smoothing = 1e-4, shear = 1e-2, rows = 1e-2;
  };
  // `row_forces`: 3 x strain rows [N m], lambda times the direction along which it acted: impulses over dt^2. Place
  // rows may say the same.
  StressField(const Body& body, const AffineMap& map, const ConstraintRows& rows,
              const Eigen::Ref<const Eigen::Matrix3Xd>& row_forces, const Eigen::Ref<const Eigen::VectorXd>& q,
              const Options& options);
  StressField(const Body& body, const AffineMap& map, const ConstraintRows& rows,
              const Eigen::Ref<const Eigen::Matrix3Xd>& row_forces, const Eigen::Ref<const Eigen::VectorXd>& q)
      : StressField(body, map, rows, row_forces, q, Options()) {}
  // S1, S2, S12 at a material point [N/m].
  Eigen::Vector3d second_pk(int panel, double u, double v) const;
  // Weft, warp at a material point.
  std::array<ThreadStress, 2> at(int panel, double u, double v) const;

 private:
  const Body& body_;
  Eigen::VectorXd q_;        // at which it was recovered
  Eigen::Matrix3Xd stress_;  // S1, S2, S12 per point of the body
};

}  // namespace toile
