// SPDX-License-Identifier: GPL-3.0-or-later
// A scene from a pattern: `toile init --pattern`.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/panel_file.h"
#include "io/pattern_json.h"

namespace toile {

struct PatternScene {
  std::string text;                   // scene.toml
  std::vector<std::string> notes;     // what was decided, for the console
  std::vector<std::string> warnings;  // what the user should look at
  std::vector<std::string> details;   // decisions that say nothing against the pattern
  std::vector<std::string> refused;   // panels of the pattern that the scene does without, and why
};

// Complete and valid: panels in their places, each hung by its highest edges; a seam for every stitch, its direction
// as the pattern states it; the body as obstacle, the pattern moved to it; how the free upper edges
// compare with the body's girth there. Names of files are written relative to the scene where they lie below it.
// `pattern` is any panel file: without placements and stitches the panels keep their places in it.
PatternScene pattern_scene(const std::filesystem::path& pattern, const std::optional<std::filesystem::path>& body,
                           const std::filesystem::path& scene, const PanelChoice& choice = {});

}  // namespace toile
