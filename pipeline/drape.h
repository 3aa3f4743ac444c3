// `toile drape` and `toile check`: a scene run, with its files.
#pragma once

#include <filesystem>
#include <optional>

#include "pipeline/console.h"
#include "pipeline/scene.h"

namespace toile {

struct DrapeOptions {
  std::optional<std::filesystem::path> directory;  // unset: out/<scene name>
  bool overwrite = false;
  bool json = false;  // the report on stdout
};

// Runs a scene and writes its files; a scene that can't be built leaves none. Returns the exit code. SIGINT ends the
// run after the present step with all files whole.
int drape(Scene scene, const DrapeOptions& options, Console& console);

// Builds the scene and says what a run would be: step and the cell that limits it, steps, estimated time and memory,
// constraint rows that aren't used and why. Writes nothing.
int dry_run(Scene scene, bool json, Console& console);

// Builds the scene, pins and loads included, and lists its panels.
int check_scene(Scene scene, bool json, Console& console);

}  // namespace toile
