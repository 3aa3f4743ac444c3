// What the program ends with. (README, "Exit codes")
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

}  // namespace toile
