// Where strain is limited besides the knot mesh: at degree 3 and above, and beside C0 knot lines.
//
// At degree p a direction of m spans has m + p control points but m + 1 knot lines: at p = 2 the knot-mesh vertices
// number one less per direction than the control points, from p = 3 on they leave the border a freedom that nothing
// limits. At a C0 line each side has a strain of its own, and the vertices see one of them. (analysis/README.md,
// "Points at degree 3", has the numbers that chose the rule.)
#pragma once

#include <vector>

#include "geometry/closure.h"
#include "trimming/constraint_points.h"

namespace toile {

enum class PointRule {
  knot_mesh,  // nothing more: the paper's
  cells,      // the middle of every cell
  half,       // every half of every span
  // As many lines more per direction as control points outnumber knot lines, in the spans whose Greville abscissae are
  // furthest from knots: on uniform knots at p = 3 the middles of the first and the last span. At p = 2 the middle of
  // the span before each C0 line, the seam of a closed surface included.
  border,
};

// Grid points of the rule's lines and the knot lines that lie inside the material, knot vertices left out, u fastest;
// of kind vertex, since the projection treats them alike, but no part of the list that `toile inspect` shows. Smooth
// panels of degree 2 get none by PointRule::border.
std::vector<ConstraintPoint> points_for_degree(const TrimmedSurface& surface, const TrimTopology& topology,
                                               PointRule rule = PointRule::border, const Closure& closure = {});

// A seam's points are listed on both of its sides. Of two that are one place of the cloth, within `distance` of a cell
// along the seam, the one at the domain's end is marked used = false, "merged".
void merge_over_seams(const NurbsSurface& surface, const Closure& closure, std::vector<ConstraintPoint>& points,
                      double distance = 0.05);

}  // namespace toile
