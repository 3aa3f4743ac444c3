// verify_trims [CASES [FIRST]]: hard random trims against exact arithmetic, seeds FIRST, FIRST + 1, ... Prints what is
// decided wrong and exits 1 where anything is.
#include <atomic>
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
  const std::uint64_t cases = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 100000;
  const std::uint64_t first = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  std::atomic<std::uint64_t> next{first};
  std::mutex mutex;
  std::map<std::string, int> families;
  int wrong = 0;
  const auto work = [&] {
    while (true) {
      const std::uint64_t seed = next++;
      if (seed >= first + cases) return;
      const TrimCase made = random_trim_case(seed);
      std::string problem;
      try {
        problem = wrong_decision(made, seed);
      } catch (const std::exception& e) {
        problem = e.what();
      }
      const std::lock_guard lock(mutex);
      ++families[made.family];
      if (problem.empty()) continue;
      ++wrong;
      if (wrong > 20) continue;
      std::printf("seed %llu: %s\n%s\n", static_cast<unsigned long long>(seed), problem.c_str(), text_of(made).c_str());
      std::fflush(stdout);
    }
  };
  std::vector<std::thread> threads;
  for (unsigned k = 1; k < std::thread::hardware_concurrency(); ++k) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  for (const auto& [family, count] : families) std::printf("  %-24s %d\n", family.c_str(), count);
  std::printf("%llu trims, each in 12 variants: %d decided wrong\n", static_cast<unsigned long long>(cases), wrong);
  return wrong == 0 ? 0 : 1;
}
