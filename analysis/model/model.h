// SPDX-License-Identifier: GPL-3.0-or-later
// A model of cloth: a body and the potentials that its deformation stores energy in.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "analysis/model/body.h"
#include "analysis/model/potential.h"
#include "geometry/fields.h"

namespace toile {

// A cell of a panel's knot mesh.
struct Cell {
  int panel = 0, i = 0, j = 0;
};
void fields(auto& archive, Like<Cell> auto& c) {
  archive(c.panel, c.i, c.j);
}
// A cell's part of dq . K(q) dq.
struct CellShare {
  Cell cell;
  double membrane = 0, bending = 0;  // J, for dq in m
};

class Model : public Body {
 public:
  using Body::Body;
  virtual std::vector<const Potential*> potentials() const = 0;
  // The cell with the largest share of dq . K(q) dq: what limits an explicit step. (TangentKind::upper)
  virtual CellShare stiffest_cell(const Eigen::Ref<const Eigen::VectorXd>& q,
                                  const Eigen::Ref<const Eigen::VectorXd>& dq) const = 0;
  virtual std::size_t table_bytes() const = 0;  // memory of what is worked out once
  // The motion of a panel's control net: where its control points are in state q [m], u fastest.
  virtual Eigen::Matrix3Xd net(int panel, const Eigen::Ref<const Eigen::VectorXd>& q) const = 0;
};

}  // namespace toile
