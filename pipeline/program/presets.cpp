// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "pipeline/base/exit_code.h"
#include "pipeline/base/json_text.h"
#include "pipeline/program/commands.h"
#include "pipeline/scene/scene.h"

namespace toile {
namespace {

int list_presets(const Common& common) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const FabricPreset& p : fabric_presets()) {
    const Fabric& f = p.fabric;
    if (common.json) {
      out.push_back(
          {{"name", p.name},
           {"about", p.about},
           {"density", f.density},
           {"thickness", f.thickness},
           {"membrane", {{"weft", f.membrane.weft}, {"warp", f.membrane.warp}, {"shear", f.membrane.shear}}},
           {"bending", {{"b0", f.bending.b0}, {"kappa0", f.bending.kappa0}, {"kappa_reg", f.bending.kappa_reg}}},
           {"drag", f.drag},
           {"friction", f.friction}});
    } else {
      fmt::print("{:10} {}: {:.4g} kg/m2, {:.4g} N/m, B0 {:.2g} N m\n", p.name, p.about, f.density, f.membrane.weft,
                 f.bending.b0);
    }
  }
  if (common.json) fmt::print("{}\n", json_text(out));
  return exit_ok;
}

}  // namespace

Action presets_command(Command& command) {
  command.about("Fabrics that need no table in the scene")
      .json("All of their numbers as JSON on stdout")
      .example("presets", "the list")
      .example("drape panel.igs --pin curve:0,2 --fabric armor", "use one")
      .exits({});
  return [](const Common& common, Console&) { return list_presets(common); };
}

}  // namespace toile
