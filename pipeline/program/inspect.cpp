#include "pipeline/inspect.h"

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "io/file.h"
#include "io/panel_file.h"
#include "pipeline/exit_code.h"
#include "pipeline/json_text.h"
#include "pipeline/program/commands.h"
#include "pipeline/program/refinement.h"

namespace toile {
namespace {

struct Arguments {
  std::string input, svg, png, html;
  RefinementArguments refinement;
};

int run(const Arguments& a, const Common& common, Console& console) {
  InspectOptions options = options_of(a.refinement);
  options.threads = common.threads;
  const Inspection inspection = inspect(read_panels(a.input), options);
  const auto draw = [&](const std::string& target, auto format) {
    if (target.empty()) return;
    write_file(target, format(inspection));
    console.note("wrote " + target);
  };
  draw(a.svg, inspect_svg);
  draw(a.png, inspect_png);
  draw(a.html, inspect_html);
  if (common.json) {
    fmt::print("{}\n", json_text(inspect_json(inspection, common.threads), 1));
  } else {
    fmt::print("{}", inspect_text(inspection, common.verbose));
  }
  for (const std::string& panel : inspection.refused) console.error(panel);
  return inspection.refused.empty() ? exit_ok : exit_geometry;
}

}  // namespace

Action inspect_command(Command& command) {
  const auto a = std::make_shared<Arguments>();
  command.about("Entities, loops, cells and constraint points of a panel file")
      .operand("FILE", a->input, "IGES, pattern JSON or DXF")
      .text("--svg", a->svg, "Draw the panels")
      .text("--png", a->png, "Draw them as a picture")
      .text("--html", a->html, "Draw them on a page with tables and warnings");
  add_refinement(command, a->refinement);
  return [a](const Common& common, Console& console) { return run(*a, common, console); };
}

}  // namespace toile
