// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/program/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <new>
#include <system_error>

#include "geometry/error.h"
#include "pipeline/base/exit_code.h"
#include "pipeline/program/command_line.h"

namespace toile {
namespace {

// A standard stream that the caller closed would be the next file opened, and take what is printed.
void keep_standard_streams() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) == -1 && ::open("/dev/null", O_RDONLY) < 0) return;
  }
}

int run_command(int argc, char** argv) {
  const CommandLine line = read_command_line(argc, argv);
  if (!line.action) return line.exit_code;
  Console console;
  console.quiet = line.common.quiet;
  console.verbose = line.common.verbose;
  console.progress = !line.common.no_progress;
  console.detect(line.common.colour);
  const auto failed = [&](const std::string& what, ExitCode code) {
    console.error(what);
    return code;
  };
  try {
    return line.action(line.common, console);
  } catch (const UsageError& error) {
    return failed(error.what(), exit_usage);
  } catch (const InputError& error) {
    return failed(error.what(), exit_input);
  } catch (const GeometryError& error) {
    return failed(error.what(), exit_geometry);
  } catch (const SolverError& error) {
    return failed(error.what(), exit_solver);
  } catch (const OutputError& error) {
    return failed(error.what(), exit_output);
  } catch (const std::filesystem::filesystem_error& error) {
    return failed(fmt::format("internal error: {}", error.what()), exit_internal);
  } catch (const std::system_error& error) {
    return failed(fmt::format("standard output: {}", error.code().message()), exit_output);
  } catch (const std::bad_alloc&) {
    return failed("out of memory", exit_internal);
  } catch (const std::exception& error) {
    return failed(fmt::format("internal error: {}", error.what()), exit_internal);
  }
}

}  // namespace

int run_program(int argc, char** argv) {
  keep_standard_streams();
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond the limit of a file's size fails, and is reported, as on a full disk
  const int code = run_command(argc, argv);
  errno = 0;
  if ((std::fflush(stdout) == 0 && std::ferror(stdout) == 0) || code != exit_ok) return code;
  Console().error(fmt::format("standard output: {}", errno ? std::strerror(errno) : "not everything was written"));
  return exit_output;
}

}  // namespace toile
