// SPDX-License-Identifier: GPL-3.0-or-later
// A surface and the loops of parameter curves that bound its material: what one IGES face is, as data.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "geometry/nurbs_curve.h"
#include "geometry/nurbs_surface.h"

namespace toile {

// One segment of a loop. `curve` runs in the file's own direction with the file's own numbers; the loop traverses it
// backwards when `reversed`. `index` is its number in the file's loop (the K of `curve:LOOP,K`), which reordering,
// reversal and repair don't change.
struct TrimCurve {
  Curve2 curve;
  int index = 0;
  bool reversed = false;
  std::optional<Curve3> model;  // the file's model-space curve, unit of the net
};

enum class LoopKind { outer, hole };

// A closed chain of parameter curves in traversal order. `index` is the loop's number in the file.
// After validate_loops (trimming/loops.h): closed within `gap`, simple, outer counter-clockwise, holes clockwise.
struct TrimLoop {
  LoopKind kind = LoopKind::outer;
  int index = 0;
  std::vector<TrimCurve> curves;
  double gap = 0;  // largest distance in the parameter plane between the end of one curve and the start of the next
};

// What a pattern draws on a panel beside its outline, in the parameter plane: carried along, never cut.
enum class MarkKind {
  grain,
  notch,
  drill,
  line,
  text,
  sew,   // where the panel is sewn; its outline is the line where it is cut
  slit,  // a cut into the material that parts nothing: an edge drawn out and back
};
std::string name(MarkKind kind);  // "grain", ...
struct PanelMark {
  MarkKind kind = MarkKind::line;
  Eigen::Vector2d at{0, 0};     // a point; where a curve starts
  std::optional<Curve2> curve;  // grain (straight, along the warp), line, sew, slit, some notches
  std::string text;
};

// A face. Numbers are the file's own; one exact factor gives metres.
struct TrimmedSurface {
  std::string name;
  NurbsSurface surface;
  std::vector<TrimLoop> loops;  // never empty after reading: a face without a trim has its natural loop
  bool natural_bounds = false;  // the loop is the border of the domain, made by natural_loop()
  double metres_per_unit = 1;
  double resolution = 0;  // smallest length that the file means (IGES global field 19), unit of the net
  std::string source;     // where it came from, for messages: "skirt.igs:412: entity 144"
  std::vector<PanelMark> marks = {};
};

// Border of the domain as one loop of four lines: curves 0 to 3 from v = min, counter-clockwise.
TrimLoop natural_loop(const NurbsSurface& surface);
// The whole of a surface as a face: its natural loop, natural_bounds set.
TrimmedSurface untrimmed(NurbsSurface surface);

// Angle of the weft against the u direction [rad, (-pi/2, pi/2], positive towards v], where the panel has a grain line:
// the grain runs along the warp, the weft at right angles to it.
std::optional<double> grain_angle(const TrimmedSurface& face);

}  // namespace toile
