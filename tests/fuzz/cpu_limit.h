// SPDX-License-Identifier: GPL-3.0-or-later
// Processor time for each input: libFuzzer's own limit counts wall time, which says nothing on a busy machine. One
// second is meant for the program as it ships; the instrumented one takes 10 to 20 times as long.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace toile {

class CpuLimit {
 public:
  CpuLimit() = default;
  CpuLimit(const CpuLimit&) = delete;
  CpuLimit& operator=(const CpuLimit&) = delete;
  ~CpuLimit() {
    const double seconds = static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC;
    if (seconds <= 10) return;
    std::fprintf(stderr, "the input took %.2f s\n", seconds);
    std::abort();
  }

 private:
  std::clock_t start_ = std::clock();
};

}  // namespace toile
