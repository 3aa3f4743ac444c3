#include "pipeline/study.h"

#include <algorithm>
#include <filesystem>
#include <memory>

#include "pipeline/program/commands.h"

namespace toile {
namespace {

struct Arguments {
  std::string input, directory;
};

int run(const Arguments& a, const Common& common, Console& console) {
  StudyOptions options;
  // Each run is this very program.
  options.program = std::filesystem::read_symlink("/proc/self/exe");
  if (!a.directory.empty()) options.directory = a.directory;
  options.overwrite = common.overwrite;
  options.json = common.json;
  options.threads = std::max(1, common.threads);
  return run_study(read_study(a.input), options, console);
}

}  // namespace

Action study_command(Command& command) {
  const auto a = std::make_shared<Arguments>();
  command.about("Run a scene many times: errors against time, stability tables")
      .operand("STUDY", a->input, "study.toml")
      .text("-o,--output", a->directory, "Directory of the results (default: out/<study name>)");
  return [a](const Common& common, Console& console) { return run(*a, common, console); };
}

}  // namespace toile
