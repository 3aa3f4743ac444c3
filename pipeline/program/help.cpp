// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <memory>

#include "pipeline/base/exit_code.h"
#include "pipeline/program/command_line.h"
#include "pipeline/program/commands.h"

namespace toile {

Action help_command(Command& command) {
  const auto topic = std::make_shared<std::string>();
  command.about("What the program or one of its commands does")
      .choice("COMMAND", *topic, command_names(), "Which; without it, all of them", false)
      .example("help drape", "options, examples and exit codes of toile drape")
      .exits({});
  return [topic](const Common&, Console&) {
    fmt::print("{}", help_text(*topic));
    return exit_ok;
  };
}

}  // namespace toile
