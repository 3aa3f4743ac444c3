// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/study/schema.h"

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "pipeline/base/exit_code.h"
#include "pipeline/base/json_text.h"
#include "pipeline/program/commands.h"

namespace toile {

Action schema_command(Command& command) {
  const auto what = std::make_shared<std::string>();
  command.about("The JSON schema of scenes or studies, for editors")
      .choice("WHAT", *what, {"scene", "study"}, "Of which files", true)
      .example("schema scene > scene.schema.json", "then `#:schema ./scene.schema.json` atop scene.toml")
      .exits({});
  return [what](const Common&, Console&) {
    fmt::print("{}\n", json_text(*what == "scene" ? scene_schema() : study_schema()));
    return exit_ok;
  };
}

}  // namespace toile
