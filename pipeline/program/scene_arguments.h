// SPDX-License-Identifier: GPL-3.0-or-later
// The scene that a command line names: a scene file, or a panel file and what holds it.
#pragma once

#include <string>
#include <vector>

#include "io/panel_file.h"
#include "pipeline/program/command.h"
#include "pipeline/scene/scene.h"

namespace toile {

struct SceneArguments {
  PanelChoice choice;
  std::string input;
  std::vector<std::string> settings;  // --set
  std::string until, time_limit;      // scene keys that have options of their own; empty: as the scene says
  // A panel file without a scene.
  std::vector<std::string> pins;
  std::string fabric, span;
  int degree = 0;
};

// Throws UsageError, and what reading a scene throws.
Scene scene_of(const SceneArguments& arguments);

}  // namespace toile
