// SPDX-License-Identifier: GPL-3.0-or-later
// What drawings do to an outline that isn't meant: edges drawn out and back, and little loops where ends overshoot.
#pragma once

#include <string>
#include <vector>

#include "geometry/trimmed_surface.h"

namespace toile {

struct OutlineTolerances {
  double join = 0;      // points nearer than this are one
  double harmless = 0;  // loops of a crossing no larger than this are cut off
};                      // at most 1e-3 and 1e-2 of the outline's size

// Loops of a crossing up to this many steps of the file's numbers are drawing accidents.
inline constexpr double harmless_steps = 10;

// The smallest decimal place that the coordinates use: 0.1 where all are multiples of it; 0 where they have all the
// digits of a double.
double decimal_step(const std::vector<Eigen::Vector2d>& points);

struct OutlineChange {
  std::string what;
  Eigen::Vector2d at{0, 0};
  double size = 0;  // of what went away
};

struct RepairedOutline {
  // The outline, and the loops that lines drawn out and back led to: closed chains, none empty.
  std::vector<std::vector<TrimCurve>> loops;
  std::vector<Curve2> slits;
  std::vector<OutlineChange> changes;  // empty: the outline is as it was given, bit for bit
};

// A closed chain of curves, head to tail, none reversed.
//   (1) A stretch drawn out and back at once is a slit: it goes from the outline. A curve that comes back later along
//       itself joins an outline and a loop (a cut to a hole): both remain, the curve goes as a slit.
//   (2) Where the outline crosses itself and the smaller of the two loops there measures at most `harmless`, that loop
//       is cut off; both curves end in the crossing.
//   (3) Curves keep their index; what is left of a curve is one curve.
// Crossings of larger loops stay: `self_crossing` says how large they are.
RepairedOutline repair_outline(std::vector<TrimCurve> chain, const OutlineTolerances& tolerances);

// The first crossing of a closed chain with itself in words, with its place and the size of the smaller loop there;
// empty where there is none.
std::string self_crossing(const std::vector<TrimCurve>& chain);

}  // namespace toile
