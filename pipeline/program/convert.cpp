#include "pipeline/convert.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "io/file.h"
#include "io/panel_file.h"
#include "pipeline/exit_code.h"
#include "pipeline/json_text.h"
#include "pipeline/program/commands.h"
#include "pipeline/program/refinement.h"

namespace toile {
namespace {

struct Arguments {
  std::string input, target;
  RefinementArguments refinement;
};

int run(const Arguments& a, const Common& common, Console& console) {
  std::error_code error;
  if (!common.overwrite && std::filesystem::equivalent(a.input, a.target, error))
    throw OutputError(fmt::format("{} is the input; give --overwrite to replace it", a.target));
  const PanelFile file = read_panels(a.input);
  const Conversion conversion = convert(file, a.target, options_of(a.refinement));
  for (const std::string& warning : conversion.warnings) console.warning(warning);
  write_file(a.target, conversion.bytes);
  std::string notes;
  for (const std::string& note : conversion.notes) notes += (notes.empty() ? "" : "; ") + note;
  console.note(fmt::format("wrote {}: {}", a.target, notes));
  if (common.json) {
    const nlohmann::ordered_json out = {{"file", utf8(a.input)},
                                        {"output", utf8(a.target)},
                                        {"panels", file.panels.size()},
                                        {"bytes", conversion.bytes.size()},
                                        {"notes", conversion.notes}};
    fmt::print("{}\n", json_text(out));
  }
  return exit_ok;
}

}  // namespace

Action convert_command(Command& command) {
  const auto a = std::make_shared<Arguments>();
  command.about("Panels to IGES, SVG (1:1), OBJ, PLY, STL, GLB or VTU, by the ending of OUT")
      .operand("IN", a->input, "IGES, pattern JSON or DXF")
      .operand("OUT", a->target, "File to write");
  add_refinement(command, a->refinement);
  return [a](const Common& common, Console& console) { return run(*a, common, console); };
}

}  // namespace toile
