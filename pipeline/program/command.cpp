// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/program/command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "pipeline/base/exit_code.h"
#include "pipeline/base/suggestion.h"

namespace toile {
namespace {

const char* const hidden = "";

// "--span LENGTH": the option's names, the value's name.
std::pair<std::string, std::string> split(const std::string& names) {
  const std::size_t space = names.find(' ');
  if (space == std::string::npos) return {names, "TEXT"};
  return {names.substr(0, space), names.substr(space + 1)};
}

std::string exit_line(int code) {
  return fmt::format("  {:<4} {}", code, meaning(static_cast<ExitCode>(code)));
}

void add_to_footer(CLI::App& app, const std::string& title, const std::string& line) {
  const std::string footer = app.get_footer();
  const bool begun = footer.find(title + ":\n") != std::string::npos;
  app.footer(footer + (begun ? "\n" : (footer.empty() ? "" : "\n\n") + title + ":\n") + line);
}

}  // namespace

Command::Command(CLI::App& program, const std::string& name, Common& common) : app_(*program.add_subcommand(name)) {
  app_.allow_extras();  // complained about by read_command_line, which knows better words
  app_.get_formatter()->column_width(28);
  app_.get_formatter()->label("REQUIRED", "");
  flag("-q,--quiet", common.quiet, "Errors only");
  flag("-v,--verbose", common.verbose, "Say more");
  text("--color auto|never", common.colour, "Colours in messages (auto: on a terminal)");
  app_.get_option("--color")->check(CLI::IsMember({"auto", "never"}));
  flag("--json", common.json, "");
  flag("--overwrite", common.overwrite, "");
  flag("--no-progress", common.no_progress, "");
  integer("--threads N", common.threads, 1, 64, "");
  for (const char* option : {"--json", "--overwrite", "--no-progress", "--threads"})
    app_.get_option(option)->group(hidden);
}

Command& Command::about(const std::string& text) {
  app_.description(text);
  return *this;
}

Command& Command::example(const std::string& words, const std::string& about) {
  add_to_footer(app_, "Examples", fmt::format("  toile {:<62} {}", words, about));
  return *this;
}

Command& Command::exits(std::initializer_list<int> codes) {
  add_to_footer(app_, "Exit codes", exit_line(exit_ok));
  add_to_footer(app_, "Exit codes", exit_line(exit_usage));
  for (const int code : codes) add_to_footer(app_, "Exit codes", exit_line(code));
  return *this;
}

CLI::Option& Command::add(CLI::Option& option, const std::string& value) {
  option.type_name(value);
  if (!value.empty()) option.option_text(value);  // in place of what CLI11 makes of checks and exclusions
  return option;
}

Command& Command::operand(const std::string& name, std::string& target, const std::string& about) {
  add(*app_.add_option(name, target, about), "").required();
  return *this;
}

Command& Command::optional_operand(const std::string& name, std::string& target, const std::string& about) {
  add(*app_.add_option(name, target, about), "");
  return *this;
}

Command& Command::choice(const std::string& name, std::string& target, const std::vector<std::string>& words,
                         const std::string& about, bool required) {
  const auto refuse = [words](const std::string& word) {
    if (std::ranges::find(words, word) != words.end()) return std::string();
    return fmt::format("there is no '{}'{}", word, suggestion(word, words));
  };
  add(*app_.add_option(name, target, about), fmt::format("{}", fmt::join(words, "|")))
      .check(refuse)
      ->required(required);
  return *this;
}

Command& Command::flag(const std::string& names, bool& target, const std::string& about) {
  app_.add_flag(names, target, about);
  return *this;
}

Command& Command::text(const std::string& names, std::string& target, const std::string& about) {
  const auto [options, value] = split(names);
  add(*app_.add_option(options, target, about), value);
  return *this;
}

Command& Command::texts(const std::string& names, std::vector<std::string>& target, const std::string& about) {
  const auto [options, value] = split(names);
  add(*app_.add_option(options, target, about), value).take_all()->allow_extra_args(false);
  return *this;
}

Command& Command::integer(const std::string& names, int& target, int least, int most, const std::string& about) {
  const auto [options, value] = split(names);
  add(*app_.add_option(options, target, about), value).check(CLI::Range(least, most));
  return *this;
}

Command& Command::show(const std::string& name, const std::string& about) {
  app_.get_option(name)->group("Options")->description(about);
  return *this;
}

Command& Command::json(const std::string& about) {
  return show("--json", about);
}

Command& Command::overwrite(const std::string& about) {
  return show("--overwrite", about);
}

Command& Command::threads(const std::string& about) {
  return show("--threads", about);
}

Command& Command::progress() {
  return show("--no-progress", "No progress line");
}

Command& Command::excludes(const std::string& name, const std::string& other) {
  CLI::Option* option = app_.get_option(other);
  app_.get_option(name)->excludes(option);
  // A text of its own keeps CLI11 from listing exclusions beside a flag.
  if (option->get_option_text().empty()) option->option_text(" ");
  return *this;
}

Command& Command::needs(const std::string& name, const std::string& other) {
  app_.get_option(name)->needs(app_.get_option(other));
  return *this;
}

}  // namespace toile
