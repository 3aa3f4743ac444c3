// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/study/process.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "geometry/error.h"

namespace toile {
namespace {

constexpr int cannot_execute = 127;

void limit(int resource, double amount) {
  rlimit bound;
  if (::getrlimit(static_cast<__rlimit_resource>(resource), &bound) != 0) return;
  const auto wanted = static_cast<rlim_t>(amount);
  if (bound.rlim_max == RLIM_INFINITY || wanted < bound.rlim_max) bound.rlim_max = wanted;
  bound.rlim_cur = bound.rlim_max;
  ::setrlimit(static_cast<__rlimit_resource>(resource), &bound);
}

// Between fork and exec: system calls only.
[[noreturn]] void become(char* const* arguments, int log, const ProcessLimits& limits, pid_t parent) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(cannot_execute);
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  limit(RLIMIT_AS, limits.megabytes * 1e6);
  limit(RLIMIT_CORE, 0);
  const int empty = ::open("/dev/null", O_RDONLY);
  ::dup2(empty, STDIN_FILENO);
  ::dup2(log, STDOUT_FILENO);
  ::dup2(log, STDERR_FILENO);
  ::execv(arguments[0], arguments);
  ::_exit(cannot_execute);
}

}  // namespace

ProcessResult run_process(const std::vector<std::string>& command, const std::filesystem::path& log,
                          const ProcessLimits& limits, const std::function<bool()>& stop) {
  using Clock = std::chrono::steady_clock;
  const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0) throw OutputError(log.string() + ": " + std::strerror(errno));
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);

  std::signal(SIGCHLD, SIG_DFL);  // ignored, it would leave nothing to wait for
  const pid_t parent = ::getpid();
  const Clock::time_point start = Clock::now();
  const pid_t child = ::fork();
  if (child == 0) become(arguments.data(), file, limits, parent);
  const int failure = errno;
  ::close(file);
  if (child < 0) throw OutputError(command[0] + ": no process can be made: " + std::strerror(failure));
  ::setpgid(child, child);

  ProcessResult result;
  int status = 0;
  rusage usage{};
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  for (;;) {
    siginfo_t ended{};
    if (::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT) != 0 && errno != EINTR) {
      throw OutputError(command[0] + ": " + std::strerror(errno));
    }
    if (ended.si_pid == child) break;
    if (result.end == ProcessResult::End::exited) {
      if (stop && stop()) result.end = ProcessResult::End::stopped;
      if (elapsed() > limits.seconds) {
        result.end = ProcessResult::End::timed_out;
        ::kill(-child, SIGINT);
      }
    }
    const bool patience =
        result.end == ProcessResult::End::timed_out && elapsed() < limits.seconds + limits.grace_seconds;
    if (result.end != ProcessResult::End::exited && !patience) ::kill(-child, SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(elapsed() < 0.1 ? 1 : 10));
  }
  ::kill(-child, SIGKILL);  // what it left running; until it is waited for, the number can't be another's
  ::wait4(child, &status, 0, &usage);
  result.wall_seconds = elapsed();
  result.cpu_seconds = static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
                       1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
  result.peak_megabytes = 1.024e-3 * static_cast<double>(usage.ru_maxrss);
  result.answered = result.end == ProcessResult::End::timed_out && WIFEXITED(status);
  if (result.end == ProcessResult::End::exited) {
    if (WIFSIGNALED(status)) result.end = ProcessResult::End::killed_by_signal;
    result.code = WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status);
  }
  return result;
}

}  // namespace toile
