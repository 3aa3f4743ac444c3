// SPDX-License-Identifier: GPL-3.0-or-later
// Constraint rows written on free nodes: d T and d G of every scalar row, the strain rows first, then the place rows.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/constraint/constraint_rows.h"
#include "analysis/linear/cholesky.h"
#include "analysis/map/affine_map.h"

namespace toile {

// Compressed rows: entries [start[r], start[r+1]) of `column` and `value`, columns ascending.
struct CompressedRows {
  std::vector<int> start{0}, column;
  std::vector<double> value;
  int size() const { return static_cast<int>(start.size()) - 1; }
};

struct ComposedRows {
  CompressedRows free;   // over nodes
  CompressedRows fixed;  // over AffineMap::fixed
};
ComposedRows compose(const AffineMap& map, const ConstraintRows& rows);

// y_r = sum over nodes and fixed control points; columns r of [begin, end).
void evaluate(const ComposedRows& rows, const Eigen::Ref<const Eigen::VectorXd>& x,
              const Eigen::Matrix3Xd& fixed_places, int begin, int end, Eigen::Matrix3Xd& y);
inline void evaluate(const ComposedRows& rows, const Eigen::Ref<const Eigen::VectorXd>& x,
                     const Eigen::Matrix3Xd& fixed_places, Eigen::Matrix3Xd& y) {
  evaluate(rows, x, fixed_places, 0, rows.free.size(), y);
}

// Per node the rows that reach it, ascending, each divided by the node's mass: M^-1 D^T.
CompressedRows transposed_by_mass(const CompressedRows& rows, const Eigen::VectorXd& node_mass);

// Diagonal of D M^-1 D^T, per scalar row; 0: the row touches only fixed control points. Throws SolverError where a node
// has no mass or a place row has a 0.
Eigen::VectorXd gram_diagonal(const AffineMap& map, const ConstraintRows& rows, const ComposedRows& composed,
                              const Eigen::VectorXd& node_mass);

// Lower triangle of D M^-1 D^T over scalar rows, which never changes: the scalar part of J M^-1 J^T.
struct GramMatrix {
  SparsePattern pattern;
  std::vector<double> value;
};
GramMatrix gram_matrix(const CompressedRows& rows, const Eigen::VectorXd& node_mass);

}  // namespace toile
