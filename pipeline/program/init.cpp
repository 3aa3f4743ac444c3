#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "geometry/error.h"
#include "io/file.h"
#include "pipeline/exit_code.h"
#include "pipeline/pattern_scene.h"
#include "pipeline/program/commands.h"
#include "pipeline/templates.h"

namespace toile {
namespace {

struct Arguments {
  std::string name, output, pattern, body;
};

void refuse_to_replace(const std::filesystem::path& file, const Common& common) {
  if (!common.overwrite && std::filesystem::exists(file))
    throw OutputError(fmt::format("{} exists; give --overwrite to replace it", file.string()));
}

int run_pattern(const Arguments& a, const Common& common, Console& console) {
  if (!a.name.empty()) throw UsageError("give a template or --pattern, not both");
  std::filesystem::path target = a.output.empty() ? "scene.toml" : a.output;
  if (target.extension() != ".toml") target /= "scene.toml";
  refuse_to_replace(target, common);
  const auto body = a.body.empty() ? std::nullopt : std::optional<std::filesystem::path>(a.body);
  const PatternScene scene = pattern_scene(a.pattern, body, target);
  for (const std::string& warning : scene.warnings) console.warning(warning);
  write_file(target, scene.text);
  for (const std::string& note : scene.notes) console.note(note);
  console.note(fmt::format("wrote {0}; now: toile check {0}", target.string()));
  return exit_ok;
}

int run_template(const Arguments& a, const Common& common, Console& console) {
  const auto templates = scene_templates();
  if (std::ranges::find(templates, a.name, &SceneTemplate::name) == templates.end()) {
    throw UsageError(fmt::format("no template is called '{}'; `toile init` lists them", a.name));
  }
  const std::filesystem::path folder = a.output.empty() ? a.name : a.output;
  const std::vector<TemplateFile> files = scene_template(a.name);
  for (const TemplateFile& file : files) refuse_to_replace(folder / file.name, common);
  for (const TemplateFile& file : files) write_file(folder / file.name, file.bytes);
  console.note(fmt::format("wrote {0}; now: toile drape {0}", (folder / "scene.toml").string()));
  return exit_ok;
}

int list_templates() {
  for (const SceneTemplate& t : scene_templates()) fmt::print("{:8} {}\n", t.name, t.about);
  return exit_ok;
}

}  // namespace

Action init_command(Command& command) {
  const auto a = std::make_shared<Arguments>();
  command.about("Write a scene to start from; without a name, list them")
      .optional_operand("TEMPLATE", a->name, "Which; without it, the list")
      .text("-o,--output", a->output,
            "Folder (default: the template's name); with --pattern the scene (default: scene.toml)")
      .text("--pattern", a->pattern, "A sewing pattern: a scene of its panels")
      .text("--body", a->body, "With --pattern: the mesh that wears it, metres, y upwards")
      .needs("--body", "--pattern");
  return [a](const Common& common, Console& console) {
    if (!a->pattern.empty()) return run_pattern(*a, common, console);
    return a->name.empty() ? list_templates() : run_template(*a, common, console);
  };
}

}  // namespace toile
