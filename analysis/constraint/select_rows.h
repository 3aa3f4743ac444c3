// SPDX-License-Identifier: GPL-3.0-or-later
// Which strain rows the projection takes.
#pragma once

#include "analysis/constraint/constraint_rows.h"
#include "analysis/map/affine_map.h"

namespace toile {

// Marks points nearer than `distance` (of a cell) to one that comes before as not used, `why` = "merged"; vertices win.
void merge_near_points(const NurbsSurface& surface, std::vector<ConstraintPoint>& points, double distance = 0.05);

// Marks constraint points that the projection can't take: `points[panel][k].used = false`, `why` = "fixed" (touches
// only fixed control points) or "merged", and returns the strain rows of the others in the order of the points, then
// those of `means` (averaged_rows()) that can move. All place rows are kept; a SolverError names two that contradict
// each other. Rows that depend on each other are taken all the same: with a stiffness they share their load
// (analysis/constraint/README.md, "Which rows").
std::vector<StrainRow> select_rows(const Body& body, const AffineMap& map,
                                   std::vector<std::vector<ConstraintPoint>>& points,
                                   const std::vector<PlaceRow>& place, const std::vector<StrainRow>& means = {});

}  // namespace toile
