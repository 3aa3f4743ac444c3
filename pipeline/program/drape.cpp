#include "pipeline/drape.h"

#include <algorithm>
#include <csignal>
#include <memory>

#include "pipeline/allocation_count.h"
#include "pipeline/program/commands.h"
#include "pipeline/program/scene_arguments.h"

namespace toile {
namespace {

struct Arguments {
  SceneArguments scene;
  std::string directory, resume;
  bool dry = false;
};

int run(const Arguments& a, const Common& common, Console& console) {
  Scene scene = scene_of(a.scene);
  if (a.dry) return dry_run(std::move(scene), common.json, console);
  DrapeOptions options;
  if (!a.directory.empty()) options.directory = a.directory;
  options.overwrite = common.overwrite;
  options.json = common.json;
  std::signal(SIGPIPE, SIG_IGN);  // a reader of the messages that goes away doesn't end the run
  options.threads = std::max(1, common.threads);
  if (allocation_count()) options.allocations = [] { return *allocation_count(); };
  if (!a.resume.empty()) options.resume = a.resume;
  return drape(std::move(scene), options, console);
}

}  // namespace

Action drape_command(Command& command) {
  const auto a = std::make_shared<Arguments>();
  command.about("Drape a scene, or a panel file held by --pin")
      .operand("SCENE", a->scene.input, "scene.toml or panel.igs")
      .text("-o,--output", a->directory, "Directory of the results (default: out/<scene name>)")
      .texts("--set", a->scene.settings, "key.path=value, any TOML value (panel.0.grain_deg=45)")
      .text("--until", a->scene.until, "Simulated time, s or with a unit")
      .flag("--dry-run", a->dry, "Say step, time and memory; run nothing")
      .text("--resume", a->resume, "Go on from a checkpoint of the same scene (DIR/checkpoint)")
      .excludes("--resume", "--dry-run")
      .text("--time-limit", a->scene.time_limit,
            "Wall time after which the run stops and leaves a checkpoint, s or with a unit")
      .texts("--pin", a->scene.pins, "Panel files: what is held, such as curve:0,2; may repeat")
      .integer("--degree", a->scene.degree, 2, 5, "Panel files: degree")
      .text("--span", a->scene.span, "Panel files: longest knot span (\"20 mm\")")
      .text("--fabric", a->scene.fabric, "Panel files: a preset");
  return [a](const Common& common, Console& console) { return run(*a, common, console); };
}

}  // namespace toile
