#include "pipeline/program/command.h"

#include <CLI/CLI.hpp>

#include "pipeline/exit_code.h"
#include "pipeline/program/command_line.h"
#include "pipeline/program/commands.h"
#include "pipeline/version.h"

namespace toile {

Command::Command(CLI::App& program, const std::string& name, Common& common) : app_(*program.add_subcommand(name)) {
  flag("-q,--quiet", common.quiet, "Errors only");
  flag("-v,--verbose", common.verbose, "Say more");
  flag("--json", common.json, "Results as JSON on stdout");
  flag("--no-progress", common.no_progress, "No progress line");
  flag("--overwrite", common.overwrite, "Replace files of a former run");
  text("--color", common.colour, "auto or never");
  app_.get_option("--color")->check(CLI::IsMember({"auto", "never"}));
  integer("--threads", common.threads, 1, 64,
          "Threads of a drape (1) or of inspect (one for each core); any number gives the same bytes");
}

Command& Command::about(const std::string& text) {
  app_.description(text);
  return *this;
}

Command& Command::operand(const std::string& name, std::string& target, const std::string& about) {
  app_.add_option(name, target, about)->required();
  return *this;
}

Command& Command::optional_operand(const std::string& name, std::string& target, const std::string& about) {
  app_.add_option(name, target, about);
  return *this;
}

Command& Command::flag(const std::string& names, bool& target, const std::string& about) {
  app_.add_flag(names, target, about);
  return *this;
}

Command& Command::text(const std::string& names, std::string& target, const std::string& about) {
  app_.add_option(names, target, about);
  return *this;
}

Command& Command::texts(const std::string& names, std::vector<std::string>& target, const std::string& about) {
  app_.add_option(names, target, about)->take_all()->allow_extra_args(false);
  return *this;
}

Command& Command::integer(const std::string& names, int& target, int least, int most, const std::string& about) {
  app_.add_option(names, target, about)->check(CLI::Range(least, most));
  return *this;
}

Command& Command::excludes(const std::string& name, const std::string& other) {
  app_.get_option(name)->excludes(app_.get_option(other));
  return *this;
}

Command& Command::needs(const std::string& name, const std::string& other) {
  app_.get_option(name)->needs(app_.get_option(other));
  return *this;
}

namespace {

struct Entry {
  const char* name;
  Action (*declare)(Command&);
};

constexpr Entry commands[] = {
    {"drape", drape_command},         {"inspect", inspect_command}, {"convert", convert_command},
    {"roundtrip", roundtrip_command}, {"check", check_command},     {"study", study_command},
    {"init", init_command},           {"presets", presets_command},
};

}  // namespace

CommandLine read_command_line(int argc, char** argv) {
  CommandLine line;
  CLI::App app{"From garment panel to draped NURBS", "toile"};
  app.set_version_flag("--version", version());
  app.require_subcommand(1);
  std::vector<Action> actions;
  for (const Entry& entry : commands) {
    Command command(app, entry.name, line.common);
    actions.push_back(entry.declare(command));
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    line.exit_code = app.exit(error) == 0 ? exit_ok : exit_usage;
    return line;
  }
  for (std::size_t k = 0; k < actions.size(); ++k) {
    if (*app.get_subcommand(commands[k].name)) line.action = actions[k];
  }
  return line;
}

}  // namespace toile
