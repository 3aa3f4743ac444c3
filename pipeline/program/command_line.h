// SPDX-License-Identifier: GPL-3.0-or-later
// The words of a command line, read: which command, and its options.
#pragma once

#include <string>
#include <vector>

#include "pipeline/program/command.h"

namespace toile {

struct CommandLine {
  Common common;
  Action action;      // unset: help, the version or a complaint was printed
  int exit_code = 0;  // what to end with then
};

CommandLine read_command_line(int argc, char** argv);

std::vector<std::string> command_names();

// The program's words, for the shell to complete.
struct OptionWords {
  std::vector<std::string> names;   // "-o", "--output"; empty: an operand
  std::string value;                // "DIR"; empty for a flag
  std::vector<std::string> values;  // all that are possible, where they are few
};
struct CommandWords {
  std::string name;
  std::vector<OptionWords> options;  // shown ones
};
std::vector<CommandWords> program_words();

// The text of `toile help` or, with a command's name, of `toile help COMMAND`. Throws UsageError for another name.
std::string help_text(const std::string& command);

}  // namespace toile
