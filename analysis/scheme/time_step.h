// SPDX-License-Identifier: GPL-3.0-or-later
// How large an explicit step may be: the largest eigenvalue of M^-1 K by Lanczos, with its residual as an upper bound.
#pragma once

#include "analysis/map/affine_map.h"
#include "analysis/model/model.h"
#include "geometry/fields.h"

namespace toile {

struct TimeStepBound {
  double dt = 0;            // s: 2 / sqrt(eigenvalue bound), without safety factor; infinite without stiffness
  double eigenvalue = 0;    // 1/s2, upper bound
  double relative_gap = 0;  // bound over Ritz value, minus 1
  Cell cell;                // the cell that limits it: largest share of the mode's energy
  bool bending = false;     // whether bending rather than membrane stiffness dominates there
};
void fields(auto& archive, Like<TimeStepBound> auto& b) {
  archive(b.dt, b.eigenvalue, b.relative_gap, b.cell, b.bending);
}

// Of the undamped, unprojected model at q, with the slope of the bending law at q's curvatures: a state that unbends
// gets stiffer, so a run asks again. Cost: 20 to 60 applications of the tangent. Deterministic. Throws SolverError
// naming the node where a mass is not positive, or where the stiffness at q is not finite. `besides`: a potential more
// than the model's.
TimeStepBound time_step_bound(const Model& model, const AffineMap& map, const Eigen::VectorXd& node_mass,
                              const Eigen::VectorXd& q, Workers* workers = nullptr, const Potential* besides = nullptr);

}  // namespace toile
