// SPDX-License-Identifier: GPL-3.0-or-later
// Where strain is sampled for the limit. [Peng & Zheng 2022, 3.3, 3.4; samples/studies/rules/README.md
// has the numbers that chose the default]
//
// At degree p a direction of m spans has m + p control points but m + 1 knot lines: at p = 2 the knot-mesh vertices
// number one less per direction than the control points, from p = 3 on they leave the border a freedom that nothing
// limits. At a C0 line each side has a strain of its own, and the vertices see one of them.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "analysis/map/smooth_seam.h"
#include "geometry/closure.h"
#include "trimming/constraint_points.h"

namespace toile {

enum class PointRule {
  knot_mesh,  // knot vertices and the crossings of trims: the paper's
  // The knot mesh and as many lines more per direction as control points outnumber knot lines, in the spans whose
  // Greville abscissae are furthest from knots: on uniform knots at p = 3 the middles of the first and the last span.
  // At p = 2 the middle of the span before each C0 line, the seam of a closed surface included.
  border,
  mid_span,   // the knot mesh and the middle of every cell
  half_span,  // the knot mesh and every half of every span
  greville,   // the Greville abscissae of both directions
  // The Greville abscissae of the derivatives' splines, one degree lower: one line less per direction than control
  // points. At p = 2 they are the knot lines; beside C0 lines and seams of closed surfaces, where two meet, one is
  // moved into the span before. At p = 1 they are the middles of the spans.
  greville_derivative,
  gauss_1,       // the middle of every cell
  gauss_2x2,     // four Gauss points in every cell
  cell_average,  // no points: the mean of each cell's tangents, see averaged_rows()
  springs_quad,  // no points: the lengths between neighbouring knot vertices
  springs_triangle,
};

// As scenes call them: "knot-mesh", "gauss-2x2", ...
struct NamedRule {
  std::string_view name;
  PointRule rule;
};
std::span<const NamedRule> point_rules();
std::optional<PointRule> point_rule(std::string_view name);

// Marks those of `listed` (constraint_points()) that the rule doesn't take: used = false, why = "rule". Returns the
// rule's other points, u fastest: all that lie inside the material, of kind vertex, since the projection treats them
// alike, but no part of the list that `toile inspect` shows. Meetings of trims with knot lines belong to the rules on
// the knot mesh and to greville_derivative (not those on the border of the domain, which has lines of its own); the
// others limit no strain at trims. Corners of trims belong to greville_derivative alone.
std::vector<ConstraintPoint> apply_rule(PointRule rule, const TrimmedSurface& surface, const TrimTopology& topology,
                                        std::vector<ConstraintPoint>& listed, const Closure& closure = {});

// A seam's points are listed on both of its sides. Of two that are one place of the cloth, within `distance` of a cell
// along the seam, the one at the domain's end is marked used = false, "merged".
void merge_over_seams(const NurbsSurface& surface, const Closure& closure, std::vector<ConstraintPoint>& points,
                      double distance = 0.05);

// Leaves out what smooth seams take of the last extra line: such a seam has one column of control points less.
void drop_extra_points(const NurbsSurface& surface, const SmoothSeams& seams, std::vector<ConstraintPoint>& extra);

}  // namespace toile
