// SPDX-License-Identifier: GPL-3.0-or-later
// Loops as closed chains within the domain: the repairs that come before any decision about them.
#pragma once

#include "trimming/loops.h"

namespace toile {

// Makes every loop a chain whose joints are bitwise equal: turns curves that chain only the other way round, drops
// curves that are a point, closes gaps within the tolerance. With `fit` the loops are moved into the domain and snapped
// to knot lines as well. Throws GeometryError naming panel, loop, curve and place where more would have to move.
std::vector<LoopRepair> close_loops(TrimmedSurface& surface, const LoopOptions& options, bool fit);

}  // namespace toile
