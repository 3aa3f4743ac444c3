// How a command declares the words it takes. CLI11 stays inside command.cpp.
#pragma once

#include <functional>
#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/console.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace toile {

// A command line that parses but makes no sense: exit 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Options that every command takes.
struct Common {
  bool quiet = false, verbose = false, json = false, no_progress = false, overwrite = false;
  std::string colour = "auto";
  int threads = 0;  // unset: one for a drape, each core for inspect
};

// What a command does once its words are read; returns the exit code.
using Action = std::function<int(const Common&, Console&)>;

// One command of the program while it declares its words. Targets must outlive the parse; names are as CLI11 takes
// them ("-o,--output"). Each call returns the command, so that they chain.
class Command {
 public:
  Command(CLI::App& program, const std::string& name, Common& common);

  Command& about(const std::string& text);

  // Words by position.
  Command& operand(const std::string& name, std::string& target, const std::string& about);
  Command& optional_operand(const std::string& name, std::string& target, const std::string& about);

  Command& flag(const std::string& names, bool& target, const std::string& about);
  Command& text(const std::string& names, std::string& target, const std::string& about);
  Command& texts(const std::string& names, std::vector<std::string>& target, const std::string& about);  // may repeat
  Command& integer(const std::string& names, int& target, int least, int most, const std::string& about);

  Command& excludes(const std::string& name, const std::string& other);
  Command& needs(const std::string& name, const std::string& other);

 private:
  CLI::App& app_;
};

}  // namespace toile
