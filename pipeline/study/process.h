// SPDX-License-Identifier: GPL-3.0-or-later
// Another program, run to its end or to its limits.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace toile {

struct ProcessLimits {
  double seconds = 600;      // wall time, then SIGINT to it and what it started
  double grace_seconds = 5;  // from there to SIGKILL
  double megabytes = 4096;   // address space (RLIMIT_AS)
};

struct ProcessResult {
  enum class End { exited, killed_by_signal, timed_out, stopped } end = End::exited;
  bool answered = false;  // timed out, and ended of its own on SIGINT: slow, not hanging
  int code = 0;           // exit code or signal
  double wall_seconds = 0, cpu_seconds = 0;
  double peak_megabytes = 0;  // resident
};

// Runs `command` (the program's path first) with standard output and error in `log`, standard input empty, in a process
// group of its own that doesn't outlive this program. `stop`, asked some 100 times a second, ends it.
// Throws OutputError where the log can't be written or no process can be made; a program that can't be executed exits
// 127.
ProcessResult run_process(const std::vector<std::string>& command, const std::filesystem::path& log,
                          const ProcessLimits& limits, const std::function<bool()>& stop);

}  // namespace toile
