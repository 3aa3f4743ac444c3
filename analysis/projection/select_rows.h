// Which strain rows the projection takes. (design.md, Decision 4)
#pragma once

#include "analysis/affine_map.h"
#include "analysis/projection/constraint_rows.h"

namespace toile {

struct RowSelectionOptions {
  // Of rows scaled to unit diagonal: below it a row depends on those already taken and becomes a guard.
  double smallest_pivot = 1e-2;
  int bends = 3;                 // random isometric bends besides the rest state, fixed seed
  double merge_distance = 0.05;  // of a cell: points nearer than this to one that comes before are merged with it
};

// Marks constraint points that the projection can't take in full: `points[panel][k].used = false`, `why` = "redundant"
// (both its rows depend on rows taken before), "fixed" (touches only fixed control points) or "merged" (too near to
// another), and returns the strain rows in the order of the points. Rows that depend on those taken before come back as
// guards, which enter the projection softly. A point of which one row is no guard stays used.
// Inner vertices are all taken; where they depend on each other (an edge between two pins) regularisation has to serve.
// Crossings follow by pivoted Cholesky of the scaled J M^-1 J^T, the one next whose smallest pivot over all states is
// largest. The rest state is what limits: a flat cloth has two directions for its rows to act in, a bent one three, and
// rows beyond the rank of the flat state are those that lock bending. Place rows are kept all and count as taken first;
// a SolverError names two that contradict each other.
// Cost: one sparse factorisation and one solve per crossing row and state, and a dense factor over the crossings.
std::vector<StrainRow> select_rows(const ShellModel& model, const AffineMap& map, const Eigen::VectorXd& node_mass,
                                   std::vector<std::vector<ConstraintPoint>>& points,
                                   const std::vector<PlaceRow>& place, const RowSelectionOptions& options = {});

}  // namespace toile
