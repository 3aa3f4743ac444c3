// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <memory>
#include <set>

#include "pipeline/base/exit_code.h"
#include "pipeline/program/command_line.h"
#include "pipeline/program/commands.h"

namespace toile {
namespace {

// What completes a value, as bash says it.
std::string completing(const OptionWords& option) {
  static const std::set<std::string> files{"FILE", "SCENE", "STUDY", "IN", "OUT"};
  if (!option.values.empty()) return fmt::format("_toile_words {}", fmt::join(option.values, " "));
  if (option.value == "DIR") return "_toile_folders";
  if (files.contains(option.value)) return "_toile_files";
  return ":";  // a number or a text: nothing to offer
}

// One command: what follows an option that takes a value, then the options, then operands.
std::string case_of(const CommandWords& command) {
  std::string out = fmt::format("    {})\n      case $previous in\n", command.name), options;
  std::string operand = ":";
  for (const OptionWords& option : command.options) {
    if (option.names.empty()) {
      operand = completing(option);  // the last: where there are several, all are files
      continue;
    }
    options += fmt::format(" {}", fmt::join(option.names, " "));
    if (!option.value.empty())
      out += fmt::format("        {}) {}; return ;;\n", fmt::join(option.names, "|"), completing(option));
  }
  return out + fmt::format("      esac\n      if [[ $current == -* ]]; then _toile_words{}; else {}; fi ;;\n", options,
                           operand);
}

std::string bash_completion() {
  const std::vector<CommandWords> commands = program_words();
  std::string names, cases;
  for (const CommandWords& command : commands) {
    names += " " + command.name;
    cases += case_of(command);
  }
  return fmt::format(R"(# bash completion for toile, written by `toile completion bash`
_toile() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD - 1]}} command=${{COMP_WORDS[1]}}
  _toile_words() {{ COMPREPLY=($(compgen -W "$*" -- "$current")); }}
  _toile_files() {{ compopt -o filenames 2>/dev/null; COMPREPLY=($(compgen -f -- "$current")); }}
  _toile_folders() {{ compopt -o filenames 2>/dev/null; COMPREPLY=($(compgen -d -- "$current")); }}
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    _toile_words{} --help --version
    return
  fi
  case $command in
{}  esac
}}
complete -F _toile toile
)",
                     names, cases);
}

}  // namespace

Action completion_command(Command& command) {
  const auto shell = std::make_shared<std::string>();
  command.about("A script that lets the shell complete commands and options")
      .choice("SHELL", *shell, {"bash"}, "Which", true)
      .example("completion bash > ~/.local/share/bash-completion/completions/toile", "make install does it, too")
      .exits({});
  return [shell](const Common&, Console&) {
    fmt::print("{}", bash_completion());
    return exit_ok;
  };
}

}  // namespace toile
