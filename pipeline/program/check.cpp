// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "pipeline/base/exit_code.h"
#include "pipeline/output/drape.h"
#include "pipeline/program/commands.h"
#include "pipeline/program/scene_arguments.h"

namespace toile {

Action check_command(Command& command) {
  const auto a = std::make_shared<SceneArguments>();
  command.about("Validate a scene with its panels, without running")
      .operand("SCENE", a->input, "scene.toml")
      .texts("--set KEY=VALUE", a->settings, "Override or add a scene key; may repeat")
      .json("The verdict as JSON on stdout")
      .example("check scene.toml", "errors name file, line and key")
      .exits({exit_input, exit_geometry});
  return [a](const Common& common, Console& console) {
    if (std::filesystem::path(a->input).extension() != ".toml")
      throw UsageError(fmt::format("{0} is no scene: `toile inspect {0}` looks at panel files", a->input));
    return check_scene([&] { return scene_of(*a); }, common.json, console);
  };
}

}  // namespace toile
