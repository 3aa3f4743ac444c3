// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "io/iges.h"
#include "pipeline/base/exit_code.h"
#include "pipeline/base/json_text.h"
#include "pipeline/inspect/inspect.h"
#include "pipeline/program/commands.h"
#include "pipeline/program/panel_argument.h"

namespace toile {
namespace {

struct Arguments {
  std::string input;
  bool rewrite = false;
};

void print_json(const Arguments& a, const PanelFile& file, const RoundtripReport& r) {
  nlohmann::ordered_json warnings = nlohmann::ordered_json::array();
  for (const std::string& warning : file.warnings) warnings.push_back(utf8(warning));
  const nlohmann::ordered_json out = {{"file", a.input},
                                      {"mode", a.rewrite ? "rewrite" : "replay"},
                                      {"exact", r.exact()},
                                      {"faces", r.faces},
                                      {"faces_lost", r.faces_lost},
                                      {"entities", r.entities},
                                      {"entities_lost", r.entities_lost},
                                      {"knots_equal", r.knots_equal},
                                      {"weights_equal", r.weights_equal},
                                      {"points_equal", r.points_equal},
                                      {"parameter_curves_equal", r.parameter_curves_equal},
                                      {"differences", r.differences},
                                      {"warnings", warnings},
                                      {"ledger", ledger_json(file.ledger)}};
  fmt::print("{}\n", json_text(out));
}

void print_text(const Arguments& a, const PanelFile& file, const RoundtripReport& r) {
  const auto word = [](bool equal) { return equal ? "equal" : "DIFFER"; };
  fmt::print(
      "{}: {} of {} faces, {} of {} entities kept; knots {}, weights {}, control points {}, parameter curves {}\n",
      a.input, r.faces - r.faces_lost, r.faces, r.entities - r.entities_lost, r.entities, word(r.knots_equal),
      word(r.weights_equal), word(r.points_equal), word(r.parameter_curves_equal));
  for (const std::string& difference : r.differences) fmt::print("  {}\n", difference);
  fmt::print("{}", ledger_text(file.ledger));
  for (const std::string& warning : file.warnings) fmt::print("  warning     {}\n", warning);
}

int run(const Arguments& a, const Common& common) {
  const PanelFile file = read_panel_argument(a.input);
  const RoundtripReport report = roundtrip(file, a.rewrite ? IgesMode::rewrite : IgesMode::replay);
  if (common.json) {
    print_json(a, file, report);
  } else {
    print_text(a, file, report);
  }
  return report.exact() ? exit_ok : exit_check;
}

}  // namespace

Action roundtrip_command(Command& command) {
  const auto a = std::make_shared<Arguments>();
  command.about("Read, write, read: is everything kept?")
      .operand("FILE", a->input, "IGES, pattern JSON or DXF")
      .flag("--rewrite", a->rewrite, "Make every known record anew instead of replaying it")
      .json("What was kept as JSON on stdout")
      .example("roundtrip panel.igs", "are knots, weights, nets and parameter curves equal bit by bit?")
      .exits({exit_input, exit_geometry, exit_check});
  return [a](const Common& common, Console&) { return run(*a, common); };
}

}  // namespace toile
