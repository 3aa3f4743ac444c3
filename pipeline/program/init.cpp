// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "geometry/error.h"
#include "io/file.h"
#include "pipeline/base/exit_code.h"
#include "pipeline/base/json_text.h"
#include "pipeline/program/commands.h"
#include "pipeline/program/panel_choice.h"
#include "pipeline/scene/pattern_scene.h"
#include "pipeline/scene/templates.h"

namespace toile {
namespace {

struct Arguments {
  std::string name, output, pattern, body;
  PanelChoice choice;
};

void say_written(const std::vector<std::filesystem::path>& files, const Common& common) {
  if (!common.json) return;
  nlohmann::ordered_json out = {{"written", nlohmann::ordered_json::array()}};
  for (const std::filesystem::path& file : files) out["written"].push_back(utf8(file.string()));
  fmt::print("{}\n", json_text(out));
}

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
  const PatternScene scene = pattern_scene(a.pattern, body, target, a.choice);
  for (const std::string& warning : scene.warnings) console.warning(warning);
  write_file(target, scene.text);
  for (const std::string& note : scene.notes) console.note(note);
  for (const std::string& detail : scene.details) console.detail(detail);
  console.note(fmt::format("wrote {0}; now: toile check {0}, then toile drape {0}", target.string()));
  say_written({target}, common);
  for (const std::string& panel : scene.refused) console.error(panel);
  return scene.refused.empty() ? exit_ok : exit_geometry;
}

int run_template(const Arguments& a, const Common& common, Console& console) {
  const std::filesystem::path folder = a.output.empty() ? a.name : a.output;
  const std::vector<TemplateFile> files = scene_template(a.name);
  for (const TemplateFile& file : files) refuse_to_replace(folder / file.name, common);
  std::vector<std::filesystem::path> written;
  for (const TemplateFile& file : files) {
    written.push_back(folder / file.name);
    write_file(written.back(), file.bytes);
  }
  console.note(fmt::format("wrote {0}; now: toile drape {0}", (folder / "scene.toml").string()));
  say_written(written, common);
  return exit_ok;
}

int list_templates(const Common& common) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const SceneTemplate& t : scene_templates()) {
    if (common.json) {
      out.push_back({{"name", t.name}, {"about", t.about}});
    } else {
      fmt::print("{:8} {}\n", t.name, t.about);
    }
  }
  if (common.json) fmt::print("{}\n", json_text(out));
  return exit_ok;
}

std::vector<std::string> template_names() {
  std::vector<std::string> names;
  for (const SceneTemplate& t : scene_templates()) names.push_back(t.name);
  return names;
}

}  // namespace

Action init_command(Command& command) {
  const auto a = std::make_shared<Arguments>();
  command.about("Write a scene to start from; without a name, list them")
      .choice("TEMPLATE", a->name, template_names(), "Which; without it, the list", false)
      .text("-o,--output DIR", a->output,
            "Folder (default: the template's name); with --pattern the scene (default: scene.toml)")
      .text("--pattern FILE", a->pattern, "A sewing pattern: a scene of its panels")
      .text("--body FILE", a->body, "With --pattern: the mesh that wears it, metres, y upwards")
      .needs("--body", "--pattern")
      .overwrite("Replace files that are there")
      .json("The templates, or the files written, as JSON on stdout")
      .example("init hang -o my_drape", "a square cloth held at two corners")
      .example("init --pattern apron.dxf -o apron.toml", "a scene of a pattern's panels, seams and pins")
      .example("init --pattern shirt.json --body body.obj -o shirt.toml", "the same, around a body")
      .exits({exit_input, exit_geometry, exit_output});
  add_choice(command, a->choice);
  return [a](const Common& common, Console& console) {
    if (!a->pattern.empty()) return run_pattern(*a, common, console);
    return a->name.empty() ? list_templates(common) : run_template(*a, common, console);
  };
}

}  // namespace toile
