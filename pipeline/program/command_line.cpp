// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/program/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <sstream>

#include "pipeline/base/exit_code.h"
#include "pipeline/base/suggestion.h"
#include "pipeline/base/version.h"
#include "pipeline/program/commands.h"

namespace toile {
namespace {

struct Entry {
  const char* name;
  Action (*declare)(Command&);
};

constexpr Entry commands[] = {
    {"drape", drape_command},           {"inspect", inspect_command},
    {"convert", convert_command},       {"roundtrip", roundtrip_command},
    {"check", check_command},           {"measure", measure_command},
    {"study", study_command},           {"init", init_command},
    {"presets", presets_command},       {"schema", schema_command},
    {"completion", completion_command}, {"help", help_command},
};

constexpr const char* first_steps = R"(First steps:
  toile inspect panel.igs --svg panel.svg            the panel's loops and curves, with their numbers
  toile drape panel.igs --pin curve:0,2 -o out/try   hang it from curve 2 of loop 0
  toile init hang -o my_drape                        a scene to start from
  toile drape my_drape/scene.toml                    drape it

`toile help COMMAND` says more, with examples.)";

// The program with all of its commands; the targets of its options live as long as it does.
struct Program {
  CLI::App app{"From garment panel to draped NURBS", "toile"};
  Common common;
  std::vector<Action> actions;

  Program() {
    app.set_version_flag("--version", version());
    app.get_formatter()->label("SUBCOMMAND", "COMMAND");
    app.get_formatter()->column_width(28);
    app.allow_extras();
    for (const Entry& entry : commands) {
      Command command(app, entry.name, common);
      actions.push_back(entry.declare(command));
      app.get_subcommand(entry.name)->group("Commands");
    }
    app.require_subcommand(1);
    std::string footer = std::string(first_steps) + "\n\nExit codes:";
    for (const ExitCode code : all_exit_codes)
      footer += fmt::format("\n  {:<4} {}", static_cast<int>(code), meaning(code));
    app.footer(footer);
  }

  const CLI::App* chosen() const {
    const auto parsed = app.get_subcommands();
    return parsed.empty() ? nullptr : parsed.front();
  }
};

std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

std::vector<TypedOption> typed_options(const CLI::App& command) {
  std::vector<TypedOption> typed;
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0 || option->get_lnames().empty()) continue;
    const bool flag = option->get_expected_min() == 0;
    typed.push_back({"--" + option->get_lnames().front(), flag ? std::vector<std::string>() : option->results()});
  }
  return typed;
}

// What an option's value may be, where its name lists it: "auto|never" and not "LENGTH".
std::vector<std::string> values_of(const std::string& value) {
  std::vector<std::string> values;
  if (std::ranges::none_of(value, [](unsigned char c) { return std::islower(c) != 0; })) return values;
  std::istringstream words(value);
  for (std::string word; std::getline(words, word, '|');) values.push_back(word);
  return values;
}

std::string did_you_mean(const std::string& word, const std::vector<std::string>& possible) {
  const auto nearest = nearest_word(word, possible);
  return nearest ? fmt::format("; did you mean '{}'?", *nearest) : "";
}

// A first word that is no command: perhaps the file itself.
std::string unknown_command(const std::string& word) {
  std::string ending = std::filesystem::path(word).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const std::string quoted = word.find(' ') == std::string::npos ? word : "'" + word + "'";
  if (ending == ".toml") return fmt::format("a command comes before the file: toile drape {}", quoted);
  if (ending == ".igs" || ending == ".iges" || ending == ".json" || ending == ".dxf")
    return fmt::format("a command comes before the file: toile inspect {}", quoted);
  return fmt::format("toile has no command '{}'{}\n`toile help` lists the commands", word,
                     did_you_mean(word, command_names()));
}

// What is wrong with a command line that CLI11 refused or didn't use up.
std::string complaint(const Program& program, const std::string& reason) {
  const std::vector<std::string> unknown = program.app.remaining(true);
  const CLI::App* command = program.chosen();
  if (!command) return unknown.empty() ? reason : unknown_command(unknown.front());
  const std::string more = fmt::format("\n`toile help {}` says what it takes", command->get_name());
  const auto is_option = [](const std::string& word) { return word.size() > 1 && word[0] == '-'; };
  const auto option = std::ranges::find_if(unknown, is_option);
  if (option != unknown.end()) {
    const std::string name = option->substr(0, option->find('='));
    return fmt::format("toile {} has no option '{}'{}{}", command->get_name(), name,
                       did_you_mean(name, option_names(*command)), more);
  }
  if (!unknown.empty()) {
    return fmt::format("toile {} has no use for '{}'{}", command->get_name(), unknown.front(), more);
  }
  return fmt::format("toile {}: {}{}", command->get_name(), reason, more);
}

}  // namespace

std::vector<std::string> command_names() {
  std::vector<std::string> names;
  for (const Entry& entry : commands) names.emplace_back(entry.name);
  return names;
}

CommandLine read_command_line(int argc, char** argv) {
  CommandLine line;
  Program program;
  std::string reason;
  if (argc < 2) {
    fmt::print(stderr, "{}", help_text(""));
    line.exit_code = exit_usage;
    return line;
  }
  try {
    program.app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    program.app.exit(asked);
    return line;
  } catch (const CLI::ParseError& error) {
    reason = error.what();
  }
  if (!reason.empty() || program.app.remaining_size(true) > 0) {
    Console().error(complaint(program, reason));
    line.exit_code = exit_usage;
    return line;
  }
  line.common = program.common;
  line.common.program = argv[0];
  line.common.typed = typed_options(*program.chosen());
  for (std::size_t k = 0; k < program.actions.size(); ++k) {
    if (*program.app.get_subcommand(commands[k].name)) line.action = program.actions[k];
  }
  return line;
}

std::string help_text(const std::string& command) {
  const Program program;
  if (command.empty()) return program.app.help();
  const std::vector<std::string> names = command_names();
  if (std::ranges::find(names, command) == names.end()) throw UsageError(unknown_command(command));
  return program.app.get_subcommand(command)->help("toile");
}

std::vector<CommandWords> program_words() {
  const Program program;
  std::vector<CommandWords> result;
  for (const CLI::App* app : program.app.get_subcommands([](const CLI::App*) { return true; })) {
    CommandWords words{app->get_name(), {}};
    for (const CLI::Option* option : app->get_options()) {
      if (option->get_group().empty()) continue;
      OptionWords entry;
      for (const std::string& name : option->get_snames()) entry.names.push_back("-" + name);
      for (const std::string& name : option->get_lnames()) entry.names.push_back("--" + name);
      if (option->get_expected_min() > 0) {
        entry.value = option->get_option_text().empty() ? option->get_name() : option->get_option_text();
        entry.values = values_of(entry.value);
      }
      words.options.push_back(entry);
    }
    result.push_back(words);
  }
  return result;
}

}  // namespace toile
