// Which strain rows the projection takes. (design.md, Decision 4)
#pragma once

#include "analysis/affine_map.h"
#include "analysis/projection/constraint_rows.h"

namespace toile {

struct RowSelectionOptions {
  double smallest_pivot = 1e-3;  // of rows scaled to unit diagonal: below it a row depends on those already taken
  int bends = 3;                 // random isometric bends besides the rest state, fixed seed
};

// Marks constraint points that the projection can't take: `points[panel][k].used = false`, `why` = "redundant" (depends
// on rows taken before), "fixed" (touches only fixed control points) or "merged" (nearer than 0.05 of an element to
// another), and returns the strain rows that remain. Vertices come first, then crossings. Place rows are kept all, or a
// SolverError names two that contradict each other.
std::vector<StrainRow> select_rows(const ShellModel& model, const AffineMap& map, const Eigen::VectorXd& node_mass,
                                   std::vector<std::vector<ConstraintPoint>>& points,
                                   const std::vector<PlaceRow>& place, const RowSelectionOptions& options = {});

}  // namespace toile
