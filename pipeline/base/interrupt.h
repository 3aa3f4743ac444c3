// SPDX-License-Identifier: GPL-3.0-or-later
// SIGINT and SIGTERM as a flag that the program polls.
#pragma once

#include <csignal>

namespace toile {

// While this lives, SIGINT and SIGTERM ask the program to finish; a second one of the same kind ends it at once. One at
// a time.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
  bool asked() const;

 private:
  struct sigaction interrupt_ = {}, terminate_ = {};
};

}  // namespace toile
