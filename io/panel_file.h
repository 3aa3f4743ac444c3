// SPDX-License-Identifier: GPL-3.0-or-later
// Panels from any file that holds them.
#pragma once

#include <filesystem>
#include <string>

#include "io/iges.h"

namespace toile {

// What of a file is read, where its format leaves a choice; empty: what the file itself says.
struct PanelChoice {
  std::string size;     // DXF: "38", or "all"
  std::string unit;     // DXF: "mm", "cm", "m", "inch" or "ft"
  std::string outline;  // DXF: "cut" (the boundary) or "sew" (the sew line, where a piece has one that is closed)
  bool operator==(const PanelChoice&) const = default;
};

// Sewing patterns (.json, .jsonc), pattern pieces (.dxf, where the program was built with dxflib); any other ending is
// read as IGES. Names are UTF-8. Throws InputError, also for a choice that the format doesn't leave, and GeometryError
// where the file holds panels and none can be.
PanelFile read_panels(const std::filesystem::path& path, const PanelChoice& choice = {});

// Throws where the file has no panel: GeometryError with the first reason where some were refused, else InputError.
void require_panels(const PanelFile& file);

// Panels without a valid trim go to `refused`, each with panel, loop and place. Throws as require_panels() does where
// none is left.
void leave_out_invalid(PanelFile& file);

}  // namespace toile
