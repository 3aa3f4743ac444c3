// SPDX-License-Identifier: GPL-3.0-or-later
// What the program ends with. (pipeline/base/README.md, "Exit codes")
#pragma once

namespace toile {

enum ExitCode : int {
  exit_ok = 0,
  exit_internal = 1,
  exit_usage = 2,
  exit_input = 3,
  exit_geometry = 4,
  exit_solver = 5,
  exit_check = 6,
  exit_time_limit = 7,
  exit_output = 8,
  exit_interrupted = 130,
};

inline constexpr ExitCode all_exit_codes[] = {exit_ok,       exit_internal,   exit_usage, exit_input,
                                              exit_geometry, exit_solver,     exit_check, exit_time_limit,
                                              exit_output,   exit_interrupted};

constexpr const char* meaning(ExitCode code) {
  switch (code) {
    case exit_ok:
      return "done";
    case exit_internal:
      return "an error inside the program, or out of memory";
    case exit_usage:
      return "the command line makes no sense";
    case exit_input:
      return "an input file is missing or invalid";
    case exit_geometry:
      return "the geometry is invalid: panel, loop and place are named";
    case exit_solver:
      return "the solver could not continue; the checkpoint holds the last good state";
    case exit_check:
      return "finished, but a check failed (strain limit, rest, energy, round trip, study)";
    case exit_time_limit:
      return "stopped by a time limit; the checkpoint holds the last state";
    case exit_output:
      return "output could not be written, or --overwrite is missing";
    case exit_interrupted:
      return "interrupted (Ctrl-C); the checkpoint holds the last state";
  }
  return "";
}

}  // namespace toile
