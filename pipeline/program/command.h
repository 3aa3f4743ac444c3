// SPDX-License-Identifier: GPL-3.0-or-later
// How a command declares the words it takes. CLI11 stays inside command.cpp.
#pragma once

#include <functional>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <vector>

#include "pipeline/base/console.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace toile {

// A command line that parses but makes no sense: exit 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// An option of the call, with its values as they were typed; a flag has none.
struct TypedOption {
  std::string name;  // the long one: "--set"
  std::vector<std::string> values;
};

// Options that every command takes, so that a script can pass them to any. A command's help shows those that change
// what it does.
struct Common {
  bool quiet = false, verbose = false, json = false, no_progress = false, overwrite = false;
  std::string colour = "auto";
  int threads = 0;                 // unset: the command's own number
  std::string program = "toile";   // as it was called
  std::vector<TypedOption> typed;  // all options of the call, the command's own among them, as they are declared
};

// What a command does once its words are read; returns the exit code.
using Action = std::function<int(const Common&, Console&)>;

// One command of the program while it declares its words. Targets must outlive the parse. `names` are as CLI11 takes
// them ("-o,--output"), with the name of the value behind a space: "-o,--output DIR". Values called FILE, SCENE, STUDY,
// IN or OUT are files, those called DIR folders: the shell completes them so. Each call returns the command, so that
// calls chain.
class Command {
 public:
  Command(CLI::App& program, const std::string& name, Common& common);

  Command& about(const std::string& text);
  // A line under "Examples"; without the program's name.
  Command& example(const std::string& words, const std::string& about);
  // Exit codes beside 0, 1 and 2, under "Exit codes".
  Command& exits(std::initializer_list<int> codes);

  // Words by position.
  Command& operand(const std::string& name, std::string& target, const std::string& about);
  Command& optional_operand(const std::string& name, std::string& target, const std::string& about);
  // An operand that is one of these words; another is refused with the nearest.
  Command& choice(const std::string& name, std::string& target, const std::vector<std::string>& words,
                  const std::string& about, bool required);

  Command& flag(const std::string& names, bool& target, const std::string& about);
  Command& text(const std::string& names, std::string& target, const std::string& about);
  Command& texts(const std::string& names, std::vector<std::string>& target, const std::string& about);  // may repeat
  Command& integer(const std::string& names, int& target, int least, int most, const std::string& about);

  // Common options that act in this command.
  Command& json(const std::string& about);
  Command& overwrite(const std::string& about);
  Command& threads(const std::string& about);
  Command& progress();

  Command& excludes(const std::string& name, const std::string& other);
  Command& needs(const std::string& name, const std::string& other);

 private:
  CLI::Option& add(CLI::Option& option, const std::string& value);
  Command& show(const std::string& name, const std::string& about);

  CLI::App& app_;
};

}  // namespace toile
