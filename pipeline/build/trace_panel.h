// SPDX-License-Identifier: GPL-3.0-or-later
// From a face to the cells and constraint points of cloth. `toile inspect` and `toile drape` both go this way, so that
// what one shows is what the other takes.
#pragma once

#include <string>
#include <vector>

#include "analysis/constraint/point_rule.h"
#include "geometry/closure.h"
#include "geometry/refine.h"
#include "geometry/trimmed_surface.h"
#include "trimming/constraint_points.h"
#include "trimming/loops.h"
#include "trimming/topology.h"

namespace toile {

// Length below which two places of a file are one: what the file says, at least 1e-9 of the surface's size.
double same_place(double resolution, const NurbsSurface& surface);

// The face's surface, clamped, with the degrees and knots asked for; lengths in the unit of the net, `tolerance` is set
// here. Throws GeometryError ("WHO: ...") where they can't be had.
NurbsSurface refined(const TrimmedSurface& face, RefineOptions asked, const std::string& who);

// One face, traced.
//   (1) The trims of `face` are valid.
//   (2) `closure` names the directions in which the surface closes on itself and cloth lies on both sides of the seam:
//       there it is glued, control points of the two edges being equal. A seam that is trimmed apart all along is no
//       seam of the cloth.
//   (3) Points that the sampling rule leaves out, or that a seam lists twice, are in `points` as not used.
struct PanelTrace {
  TrimmedSurface face;
  std::vector<LoopRepair> repairs;
  TrimTopology topology;
  Closure closure;
  std::vector<int> leader;                    // per control point: the one that stands for it, see seam_leaders()
  std::vector<ConstraintPoint> points;        // the listed ones
  std::vector<ConstraintPoint> extra_points;  // of the sampling rule only
};

// `face`: its surface refined and clamped, its trims as the file has them. Throws GeometryError with loop and place.
PanelTrace trace_panel(TrimmedSurface face, PointRule sampling);

}  // namespace toile
