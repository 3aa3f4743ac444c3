// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/inspect/inspect.h"

#include <fmt/format.h>

#include <memory>
#include <utility>

#include "io/file.h"
#include "pipeline/base/exit_code.h"
#include "pipeline/program/commands.h"
#include "pipeline/program/panel_argument.h"
#include "pipeline/program/panel_choice.h"
#include "pipeline/program/refinement.h"

namespace toile {
namespace {

struct Arguments {
  std::string input, svg, png, html;
  RefinementArguments refinement;
  PanelChoice choice;
};

int report_refused(const std::vector<std::string>& refused, Console& console) {
  for (const std::string& panel : refused) console.error(panel);
  return refused.empty() ? exit_ok : exit_geometry;
}

int run(const Arguments& a, const Common& common, Console& console) {
  InspectOptions options = options_of(a.refinement);
  options.threads = common.threads;
  for (const std::string* target : {&a.svg, &a.png, &a.html}) require_free(*target, common.overwrite);
  PanelFile file = read_panel_argument(a.input, a.choice);
  file.file.reset();  // the records, as large as the file
  if (common.json && a.svg.empty() && a.png.empty() && a.html.empty()) {
    const InspectionText text = inspect_to_json(std::move(file), options);
    for (const std::string& piece : text.pieces) fmt::print("{}", piece);
    fmt::print("\n");
    return report_refused(text.refused, console);
  }
  const Inspection inspection = inspect(std::move(file), options);
  const auto draw = [&](const std::string& target, auto format) {
    if (target.empty()) return;
    write_file(target, format(inspection));
    console.note("wrote " + target);
  };
  draw(a.svg, inspect_svg);
  draw(a.png, inspect_png);
  draw(a.html, inspect_html);
  if (common.json) {
    fmt::print("{}\n", inspect_json_text(inspection));
  } else {
    fmt::print("{}", inspect_text(inspection, common.verbose));
  }
  return report_refused(inspection.refused, console);
}

}  // namespace

Action inspect_command(Command& command) {
  const auto a = std::make_shared<Arguments>();
  command.about("Entities, loops, cells and constraint points of a panel file")
      .operand("FILE", a->input, "IGES, pattern JSON or DXF")
      .text("--svg OUT", a->svg, "Draw the panels")
      .text("--png OUT", a->png, "Draw them as a picture")
      .text("--html OUT", a->html, "Draw them on a page with tables and warnings")
      .json("Everything as JSON on stdout, lengths in metres")
      .threads("Threads (default: one for each core); any number gives the same bytes")
      .example("inspect panel.igs", "panels, loops and curves as tables")
      .example("inspect panel.igs --svg panel.svg", "a drawing with the numbers that addresses use")
      .example("inspect pattern.dxf --span '20 mm' --json", "cells and constraint points of that refinement")
      .exits({exit_input, exit_geometry, exit_output});
  add_refinement(command, a->refinement);
  add_choice(command, a->choice);
  return [a](const Common& common, Console& console) { return run(*a, common, console); };
}

}  // namespace toile
