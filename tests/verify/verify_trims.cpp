// SPDX-License-Identifier: GPL-3.0-or-later
// verify_trims [CASES [FIRST]]: hard random trims against exact arithmetic, seeds FIRST, FIRST + 1, ... Prints what is
// decided wrong and the slowest case, and exits 1 where anything is wrong or a case doesn't end.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "trimming/trim_cases.h"

int main(int argc, char** argv) {
  using namespace toile::test;
  using Clock = std::chrono::steady_clock;
  const auto since = [](Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  constexpr double patience = 300;  // s for one case; the slowest known take one
  const std::uint64_t cases = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 100000;
  const std::uint64_t first = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  std::atomic<std::uint64_t> next{first};
  std::mutex mutex;
  std::condition_variable ended;
  std::map<std::string, int> families;
  std::map<std::uint64_t, Clock::time_point> running;  // by seed
  std::uint64_t done = 0, slowest = first;
  double longest = 0;
  int wrong = 0;
  const auto work = [&] {
    while (true) {
      const std::uint64_t seed = next++;
      if (seed >= first + cases) return;
      const auto start = Clock::now();
      {
        const std::lock_guard lock(mutex);
        running[seed] = start;
      }
      const TrimCase made = random_trim_case(seed);
      std::string problem;
      try {
        problem = wrong_decision(made, seed);
      } catch (const std::exception& e) {
        problem = e.what();
      }
      const std::lock_guard lock(mutex);
      running.erase(seed);
      if (since(start) > longest) longest = since(start), slowest = seed;
      if (++done == cases) ended.notify_one();
      ++families[made.family];
      if (problem.empty()) continue;
      ++wrong;
      if (wrong > 20) continue;
      std::printf("seed %llu: %s\n%s\n", static_cast<unsigned long long>(seed), problem.c_str(), text_of(made).c_str());
      std::fflush(stdout);
    }
  };
  const auto begin = Clock::now();
  std::vector<std::thread> threads;
  for (unsigned k = 0; k < std::max(1u, std::thread::hardware_concurrency()); ++k) threads.emplace_back(work);
  double told = 0;
  for (std::unique_lock lock(mutex); done < cases; ended.wait_for(lock, std::chrono::seconds(1))) {
    for (const auto& [seed, start] : running) {
      if (since(start) < patience) continue;
      std::printf("seed %llu: not decided after %.0f s\n%s\n", static_cast<unsigned long long>(seed), patience,
                  text_of(random_trim_case(seed)).c_str());
      std::fflush(stdout);
      std::_Exit(1);
    }
    if (since(begin) < told + 30) continue;
    told = since(begin);
    std::fprintf(stderr, "%llu of %llu trims in %.0f s\n", static_cast<unsigned long long>(done),
                 static_cast<unsigned long long>(cases), told);
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& [family, count] : families) std::printf("  %-24s %d\n", family.c_str(), count);
  std::printf("%llu trims, each in 12 variants, in %.0f s: %d decided wrong; slowest seed %llu, %.2f s\n",
              static_cast<unsigned long long>(cases), since(begin), wrong, static_cast<unsigned long long>(slowest),
              longest);
  return wrong == 0 ? 0 : 1;
}
