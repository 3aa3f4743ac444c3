// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/convert/convert.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cctype>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "io/file.h"
#include "io/file_formats.h"
#include "pipeline/base/exit_code.h"
#include "pipeline/base/json_text.h"
#include "pipeline/program/commands.h"
#include "pipeline/program/panel_argument.h"
#include "pipeline/program/panel_choice.h"
#include "pipeline/program/refinement.h"

namespace toile {
namespace {

struct Arguments {
  std::string input, target, up;
  std::vector<std::string> only;
  RefinementArguments refinement;
  PanelChoice choice;
};

// ".igs; .svg (drawings at 1:1); .obj, .ply (triangles of the cloth)".
std::string endings() {
  const std::pair<FormatContent, const char*> groups[] = {{FormatContent::faces, ""},
                                                          {FormatContent::drawing, " (drawings at 1:1)"},
                                                          {FormatContent::triangles, " (triangles of the cloth)"},
                                                          {FormatContent::nets, " (control nets)"}};
  std::vector<std::string> out;
  for (const auto& [what, words] : groups) {
    std::vector<std::string_view> of_group;
    for (const NamedFormat& format : file_formats())
      if (format.what == what) of_group.push_back(format.ending);
    out.push_back(fmt::format("{}{}", fmt::join(of_group, ", "), words));
  }
  return fmt::format("{}", fmt::join(out, "; "));
}

std::string about() {
  std::string names;
  for (const NamedFormat& format : file_formats()) {
    for (const char c : format.name) names += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    names += ", ";
  }
  return "Panels to " + names + "by the ending of OUT";
}

std::string about_target() {
  return "File to write: " + endings() +
         ". Triangles and nets are in metres and in the axes of IN; GLB alone is turned, so that +Y points up, as its "
         "standard says. Texture coordinates: the patterns laid out in 0..1, v from the top in GLB, else from below. "
         "\"NAME flat\" and \"NAME draped\" of a draped.igs have the same triangles, as for a morph";
}

ConvertOptions options_of(const Arguments& a) {
  ConvertOptions options;
  options.refine = options_of(a.refinement);
  options.only = a.only;
  if (a.up.empty()) return options;
  options.up = axis_named(a.up);
  if (!options.up) throw UsageError(fmt::format("--up {}: must be x, y, z, -x, -y or -z", a.up));
  return options;
}

int run(const Arguments& a, const Common& common, Console& console) {
  const ConvertOptions options = options_of(a);
  const PanelFile file = read_panel_argument(a.input, a.choice);
  for (const std::filesystem::path& path : conversion_targets(a.target)) require_free(path, common.overwrite);
  const Conversion conversion = convert(file, a.target, options);
  for (const std::string& warning : conversion.warnings) console.warning(warning);
  for (const std::string& detail : conversion.details) console.detail(detail);
  for (const auto& [path, bytes] : conversion.beside) write_file(path, bytes);
  write_file(a.target, conversion.bytes);
  std::string notes;
  for (const std::string& note : conversion.notes) notes += (notes.empty() ? "" : "; ") + note;
  console.note(fmt::format("wrote {}: {}", a.target, notes));
  if (common.json) {
    const nlohmann::ordered_json out = {{"file", utf8(a.input)},       {"output", utf8(a.target)},
                                        {"panels", conversion.panels}, {"bytes", conversion.bytes.size()},
                                        {"notes", conversion.notes},   {"refused", conversion.refused}};
    fmt::print("{}\n", json_text(out));
  }
  for (const std::string& panel : conversion.refused) console.error(panel);
  return conversion.refused.empty() ? exit_ok : exit_geometry;
}

}  // namespace

Action convert_command(Command& command) {
  const auto a = std::make_shared<Arguments>();
  command.about(about())
      .operand("IN", a->input, "IGES, pattern JSON or DXF")
      .operand("OUT", a->target, about_target())
      .texts("--only NAME", a->only, "The panel of this name; may repeat")
      .text("--up AXIS", a->up, "GLB: which axis of IN points up (as draped.igs says; else z for IGES, y for patterns)")
      .overwrite("Replace OUT where it is there")
      .json("What was written as JSON on stdout")
      .example("convert pattern.dxf pattern.igs", "pattern pieces as trimmed surfaces")
      .example("convert panel.igs panel.svg", "an outline to print, 1:1")
      .example("convert draped.igs front.glb --only 'front draped'", "one panel, for the web and for Blender")
      .exits({exit_input, exit_geometry, exit_output});
  add_refinement(command, a->refinement);
  add_choice(command, a->choice);
  return [a](const Common& common, Console& console) { return run(*a, common, console); };
}

}  // namespace toile
