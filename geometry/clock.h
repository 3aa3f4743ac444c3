// SPDX-License-Identifier: GPL-3.0-or-later
// Wall time for reports.
#pragma once

#include <chrono>

namespace toile {

using Clock = std::chrono::steady_clock;
inline double since(Clock::time_point start) {  // s
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace toile
