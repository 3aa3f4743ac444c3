// SPDX-License-Identifier: GPL-3.0-or-later
// Panels of a plane drawing hung as they are worn: the grain, which runs along the warp, stands upright.
#pragma once

#include <optional>
#include <vector>

#include "io/pattern_json.h"

namespace toile {

// Places for the panels of a file that says none.
//   (1) flat panels in parallel planes are turned into the plane z = 0 with their grain along y, the side up that lies
//       higher in the drawing (its right side, where the grain lies level); panels without a grain line keep y, or v,
//       upright;
//   (2) they hang side by side from y = 0 downwards, in the file's order, a gap between them;
//   (3) where all stand upright already and none overlaps another, they stay where they are.
// Nothing for other panels: they lie in space as the file has them.
std::optional<std::vector<PatternPlace>> hang_upright(const std::vector<TrimmedSurface>& panels);

}  // namespace toile
