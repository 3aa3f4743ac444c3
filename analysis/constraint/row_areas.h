// SPDX-License-Identifier: GPL-3.0-or-later
// The area of cloth that each strain row represents: the weights with which their points integrate a stress.
#pragma once

#include <vector>

#include "analysis/constraint/constraint_rows.h"
#include "analysis/map/affine_map.h"

namespace toile {

// Sets `area` of the weft and warp rows of points, both kinds together; `values[r]` has the functions N at the point of
// rows[r]. They start from shares: each node of the map divides its own cloth among the points that its function
// reaches, in proportion to the function where that is positive, so that they add up to the panels' area. Weft and warp
// are then weighed each by itself, between `least` and `most` times the share, so that
//   sum over r of area_r d_r = integral over the cloth of N_,weft (N_,warp)   for every node,
// in least squares with these bounds (areas found without them and cut afterwards are no solution): a uniform stress of
// the limit is in equilibrium with what the cloth's border carries. On a uniform net at p = 2 that is the trapezoidal
// rule along the threads and Simpson's across.
//   (1) they still add up to the panels' area, but for nodes that reach no point; (2) independent of which nodes pins
//       hold, but for control points that would follow others (extended, at smooth seams) if no pin held them; (3) no
//       area is below a thousandth of the panel's mean: such a row would count as hard.
struct RowAreaOptions {
  double least = 0.02, most = 3;  // a row that others can stand for needn't vanish, nor one take over its neighbours
  double damping = 3e-5;  // of a panel's longest equation: poorly determined weights stay near their initial share
  int newton_steps = 100, iterations = 40;  // at most, and of each: what is undetermined by then stays near the shares
};
void weigh_rows(const Body& body, const AffineMap& map, const std::vector<ScalarRow>& values,
                std::vector<StrainRow>& rows, const RowAreaOptions& options = {});

// What those areas leave over in weft and warp: |sum of area_r d_r - integral of N_,a| over |integral of N_,a|, in the
// sum of absolute values over the free nodes.
Eigen::Vector2d unbalanced_part(const Body& body, const AffineMap& map, const std::vector<StrainRow>& rows);

}  // namespace toile
