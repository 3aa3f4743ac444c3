// The words of a command line, read: which command, and its options.
#pragma once

#include "pipeline/program/command.h"

namespace toile {

struct CommandLine {
  Common common;
  Action action;      // unset: help, the version or a complaint was printed
  int exit_code = 0;  // what to end with then
};

CommandLine read_command_line(int argc, char** argv);

}  // namespace toile
