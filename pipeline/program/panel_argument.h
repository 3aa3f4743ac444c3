// SPDX-License-Identifier: GPL-3.0-or-later
// The panel file that a command line names; a scene or a study in its place is pointed to the command that takes it.
#pragma once

#include <string>

#include "io/panel_file.h"

namespace toile {

// Throws InputError where the file is a TOML file, with what to run instead, and what read_panels throws.
PanelFile read_panel_argument(const std::string& path, const PanelChoice& choice = {});

// What a TOML file seems to be, by its keys: "a scene", "a study" or "a TOML file".
enum class TomlKind { scene, study, other };
TomlKind toml_kind(const std::string& path);

}  // namespace toile
