// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/study/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "geometry/error.h"
#include "pipeline/base/exit_code.h"
#include "pipeline/program/commands.h"
#include "pipeline/program/panel_argument.h"

namespace toile {
namespace {

struct Arguments {
  std::string input, directory;
};

int run(const Arguments& a, const Common& common, Console& console) {
  if (toml_kind(a.input) == TomlKind::scene)
    throw InputError(fmt::format("{0} is a scene, not a study: `toile drape {0}` runs it", a.input));
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
      .text("-o,--output DIR", a->directory, "Directory of the results (default: out/<study name>)")
      .overwrite("Run again what an earlier call has run")
      .json("study.json on stdout instead of the table")
      .threads("Threads of each run (default 1)")
      .progress()
      .example("study study.toml -o out/study", "the same command goes on with an interrupted study")
      .exits({exit_input, exit_check, exit_output, exit_interrupted});
  return [a](const Common& common, Console& console) { return run(*a, common, console); };
}

}  // namespace toile
