// SPDX-License-Identifier: GPL-3.0-or-later
// From a panel to its drape in one call. For several panels, loads, frames or a run that is watched: read_scene(),
// build() and Run.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "geometry/trimmed_surface.h"

namespace toile {

struct PanelDrape {
  std::string fabric = "skirt";       // of `toile presets`
  std::optional<int> degree;          // of the analysis; unset: the surface's, at least 2
  std::optional<double> span;         // m, largest span of the analysis; unset: one that shows how the panel drapes
  std::optional<double> until;        // s; unset: until the cloth is at rest
  std::vector<std::string> settings;  // further keys as a scene has them: "strain_limit.stretch=0.02"
  int threads = 1;
};

// The panel as it hangs from `pins`, which are addresses as scenes use them ("curve:0,2", "corner:0,0", "uv:0.5,0.5"):
// the same trims, the refined surface's control net moved, lengths in the panel's unit. Gravity pulls along -z. Throws
// InputError for pins, fabrics and settings that don't exist, GeometryError for a panel that can't be draped,
// SolverError where the run can't go on or a check fails, with its reason.
TrimmedSurface drape(const TrimmedSurface& panel, const std::vector<std::string>& pins, const PanelDrape& how = {});

}  // namespace toile
