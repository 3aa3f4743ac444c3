// SPDX-License-Identifier: GPL-3.0-or-later
// Other programs that want every core.
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <stdexcept>
#include <thread>
#include <vector>

namespace toile::bench {

// One process a core that does nothing but run, from construction to destruction.
class BusyCores {
 public:
  BusyCores() {
    for (unsigned k = 0; k < std::thread::hardware_concurrency(); ++k) {
      const pid_t child = ::fork();
      if (child < 0) throw std::runtime_error("no process for a busy core");
      if (child == 0) {
        ::alarm(longest_seconds);  // ends by itself where the parent can't end it
        for (volatile unsigned turns = 0;;) turns = turns + 1;
      }
      children_.push_back(child);
    }
  }
  ~BusyCores() {
    for (const pid_t child : children_) ::kill(child, SIGKILL);
    for (const pid_t child : children_) ::waitpid(child, nullptr, 0);
  }
  BusyCores(const BusyCores&) = delete;
  BusyCores& operator=(const BusyCores&) = delete;

 private:
  static constexpr unsigned longest_seconds = 600;
  std::vector<pid_t> children_;
};

}  // namespace toile::bench
