#include <filesystem>
#include <memory>

#include "pipeline/drape.h"
#include "pipeline/program/commands.h"
#include "pipeline/program/scene_arguments.h"

namespace toile {

Action check_command(Command& command) {
  const auto a = std::make_shared<SceneArguments>();
  command.about("Validate a scene with its panels, without running")
      .operand("SCENE", a->input, "scene.toml")
      .texts("--set", a->settings, "key.path=value");
  return [a](const Common& common, Console& console) {
    if (std::filesystem::path(a->input).extension() != ".toml") throw UsageError("check takes a scene.toml");
    return check_scene(scene_of(*a), common.json, console);
  };
}

}  // namespace toile
