// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "geometry/error.h"
#include "io/file.h"
#include "pipeline/base/exit_code.h"
#include "pipeline/base/json_text.h"
#include "pipeline/measure/draped_panel.h"
#include "pipeline/program/commands.h"
#include "pipeline/program/panel_argument.h"
#include "pipeline/program/refinement.h"

namespace toile {
namespace {

struct Arguments {
  std::string what, input, support, svg;
};

void print_json(const std::string& file, const DrapeMeasure& m, const Shadow& shadow) {
  nlohmann::ordered_json nodes = nlohmann::ordered_json::array();
  for (const DrapeNode& node : m.nodes)
    nodes.push_back({{"angle", node.angle}, {"radius", node.radius}, {"amplitude", node.amplitude}});
  fmt::print("{}\n", json_text({{"file", file},
                                {"support", m.support},
                                {"area", m.area},
                                {"flat_area", m.flat_area},
                                {"drape_coefficient", m.coefficient},
                                {"node_count", m.nodes.size()},
                                {"nodes", nodes},
                                {"outline", shadow.radius}}));
}

int run(const Arguments& a, const Common& common, Console& console) {
  if (a.support.empty()) throw UsageError("toile measure drape needs --support RADIUS");
  const double support = length_option(a.support, "--support");
  require_free(a.svg, common.overwrite);
  const std::filesystem::path input(a.input);
  const std::string file = std::filesystem::is_directory(input) ? (input / "draped.igs").string() : a.input;
  const DrapedPanel panel = draped_panel(read_panel_argument(file));
  const Shadow shadow = shadow_of(panel.points, panel.triangles, panel.centre, support);
  if (!(panel.flat_area > std::numbers::pi * support * support))
    throw InputError(fmt::format("{}: a support of {} m is larger than the cloth", file, support));
  const DrapeMeasure m = measure_drape(shadow, support, panel.flat_area);
  if (!a.svg.empty()) {
    write_file(a.svg, drape_svg(shadow, m));
    console.note("wrote " + a.svg);
  }
  if (common.json) {
    print_json(file, m, shadow);
    return exit_ok;
  }
  fmt::print("{}: drape coefficient {:.2f} %, {} nodes; shadow {:.6f} m2, flat {:.6f} m2, support {} m\n", file,
             m.coefficient, m.nodes.size(), m.area, m.flat_area, m.support);
  for (const DrapeNode& node : m.nodes)
    fmt::print("  node at {:6.1f} deg: radius {:.1f} mm, amplitude {:.1f} mm\n", node.angle * 180 / std::numbers::pi,
               1000 * node.radius, 1000 * node.amplitude);
  return exit_ok;
}

}  // namespace

Action measure_command(Command& command) {
  const auto a = std::make_shared<Arguments>();
  command.about("Read numbers off draped cloth: Cusick's drape coefficient and nodes")
      .choice("WHAT", a->what, {"drape"}, "drape: shadow, drape coefficient, nodes", true)
      .operand("DIR", a->input, "A run's folder, or its draped.igs")
      .text("--support RADIUS", a->support,
            "Radius of the support below the cloth's middle, m or with a unit (\"90 mm\")")
      .text("--svg OUT", a->svg, "Draw the shadow's outline, 1:1")
      .json("Everything as JSON on stdout, the outline's radius ray by ray too")
      .overwrite("Replace the drawing")
      .example("measure drape out/cusick --support '90 mm'", "drape coefficient and nodes of a disc over 18 cm")
      .example("measure drape out/cusick --support '90 mm' --svg outline.svg", "its outline as a drawing")
      .exits({exit_input, exit_geometry, exit_output});
  return [a](const Common& common, Console& console) { return run(*a, common, console); };
}

}  // namespace toile
