// SPDX-License-Identifier: GPL-3.0-or-later
// `toile drape` and `toile check`: a scene run, with its files.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "pipeline/base/console.h"
#include "pipeline/scene/scene.h"

namespace toile {

struct DrapeOptions {
  std::optional<std::filesystem::path> directory;  // unset: out/<scene name>
  bool overwrite = false;
  bool json = false;                            // the report on stdout
  int threads = 1;                              // of forces and tangents; any number gives the same bytes
  std::optional<std::filesystem::path> resume;  // a checkpoint to go on from
  std::string command;  // as typed, without directory and checkpoint, for the advice on how to resume; empty: no advice
};

// Runs a scene and writes its files; a scene that can't be built, and a checkpoint that doesn't fit, leave none.
// Returns the exit code. DIR/checkpoint is replaced every second and at the end. SIGINT, SIGTERM and the scene's time
// limit (of wall time since the call) end the run after the present step, with the files of its last state. A run that
// resumes in the checkpoint's own folder goes on with the frames there.
int drape(Scene scene, const DrapeOptions& options, Console& console);

// Builds the scene and says what a run would be: step and the cell that limits it, steps, estimated time and memory,
// constraint rows that aren't used and why. Writes nothing.
int dry_run(Scene scene, bool json, Console& console);

// Reads and builds the scene, pins and loads included, and every obstacle; lists panels and obstacles, and all faults.
// With `json` the verdict goes to stdout, whatever is wrong with the input. Returns the exit code of the first fault.
int check_scene(const std::function<Scene()>& read, bool json, Console& console);

}  // namespace toile
