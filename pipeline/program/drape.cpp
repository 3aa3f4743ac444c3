// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/output/drape.h"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <memory>
#include <string>
#include <string_view>

#include "pipeline/base/exit_code.h"
#include "pipeline/output/summary.h"
#include "pipeline/program/commands.h"
#include "pipeline/program/panel_choice.h"
#include "pipeline/program/scene_arguments.h"

namespace toile {
namespace {

struct Arguments {
  SceneArguments scene;
  std::string directory, resume;
  bool dry = false;
};

// The words of this call without those of its folder, to go on from where the run stops.
std::string words(const Arguments& a, const Common& common) {
  constexpr std::string_view of_the_folder[] = {"--output", "--overwrite", "--resume"};
  std::string out = shell_word(common.program) + " drape " + shell_word(a.scene.input);
  for (const auto& [name, values] : common.typed) {
    if (std::ranges::find(of_the_folder, name) != std::end(of_the_folder)) continue;
    if (values.empty()) out += " " + name;
    for (const std::string& value : values) out += fmt::format(" {} {}", name, shell_word(value));
  }
  return out;
}

int run(const Arguments& a, const Common& common, Console& console) {
  Scene scene = scene_of(a.scene);
  if (a.dry) return dry_run(std::move(scene), common.json, console);
  DrapeOptions options;
  if (!a.directory.empty()) options.directory = a.directory;
  options.overwrite = common.overwrite;
  options.json = common.json;
  std::signal(SIGPIPE, SIG_IGN);  // a reader of the messages that goes away doesn't end the run
  options.threads = std::max(1, common.threads);
  if (!a.resume.empty()) options.resume = a.resume;
  options.command = words(a, common);
  return drape(std::move(scene), options, console);
}

}  // namespace

Action drape_command(Command& command) {
  const auto a = std::make_shared<Arguments>();
  command.about("Drape a scene, or a panel file held by --pin")
      .operand("SCENE", a->scene.input, "scene.toml, or a panel file with --pin")
      .text("-o,--output DIR", a->directory, "Directory of the results (default: out/<scene name>)")
      .texts("--set KEY=VALUE", a->scene.settings,
             "Override or add a scene key, any TOML value (panel.0.grain_deg=45); may repeat")
      .text("--until TIME", a->scene.until, "Simulated time, s or with a unit")
      .flag("--dry-run", a->dry, "Say step, time and memory; run nothing")
      .text("--resume FILE", a->resume,
            "Go on from a checkpoint of the same scene (DIR/checkpoint); not with --dry-run")
      .excludes("--resume", "--dry-run")
      .text("--time-limit TIME", a->scene.time_limit,
            "Wall time after which the run stops and leaves a checkpoint, s or with a unit")
      .texts("--pin ADDRESS", a->scene.pins, "Panel files: what is held, such as curve:0,2; may repeat")
      .integer("--degree N", a->scene.degree, 2, 5, "Panel files: degree")
      .text("--span LENGTH", a->scene.span, "Panel files: longest knot span, m or with a unit (\"20 mm\")")
      .text("--fabric NAME", a->scene.fabric, "Panel files: a preset (toile presets lists them)")
      .overwrite("Replace the files of a former run in DIR")
      .json("The report (or, with --dry-run, the plan) as JSON on stdout")
      .threads("Threads (default 1); any number gives the same bytes")
      .progress()
      .example("drape scene.toml -o out/first", "a scene")
      .example("drape scene.toml --dry-run", "step, time and memory of the run")
      .example("drape scene.toml --overwrite --set fabric.cotton.drag=0.5", "one key changed")
      .example("drape panel.igs --pin curve:0,2 --span '20 mm'", "a panel file without a scene")
      .example("drape scene.toml -o out/first --resume out/first/checkpoint", "go on where it stopped")
      .exits({exit_input, exit_geometry, exit_solver, exit_check, exit_time_limit, exit_output, exit_interrupted});
  add_choice(command, a->scene.choice);
  return [a](const Common& common, Console& console) { return run(*a, common, console); };
}

}  // namespace toile
