// SPDX-License-Identifier: GPL-3.0-or-later
// Which place rows hold something that the rows before them don't.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/map/affine_map.h"
#include "analysis/model/body.h"

namespace toile {

struct Candidate {
  ScalarRow row;
  int pin = 0;
  bool required = false;          // more than one of several along a curve
  Eigen::Vector3d axes{1, 1, 1};  // 1: component held, 0: free
  bool difference = false;        // of places: kept, not moved
  int seam = -1;                  // whose `point` it is, instead of a pin; -1: none
  int point = 0;
};

// Which candidates are independent of the fixed control points and of those taken before them, in the order given but
// for the required ones, which come first: the pivots of a Cholesky factorisation of the rows' inertia N M^-1 N^T,
// scaled to unit diagonal, that leaves out rows of too small a pivot. The factor has the taken rows only, so that time
// and memory grow with their number, and by candidate only with what it shares with them. `mass` is by node [kg].
// Candidates that don't hold the axis are left out.
std::vector<bool> independent(const std::vector<Candidate>& candidates, const AffineMap& map,
                              const Eigen::VectorXd& mass, int axis = 0);
// Axis by axis: which axes each of them holds that those before don't.
std::vector<Eigen::Vector3d> independent_axes(const std::vector<Candidate>& candidates, const AffineMap& map,
                                              const Eigen::VectorXd& mass);

}  // namespace toile
