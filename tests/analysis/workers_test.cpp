// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/parallel/workers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace toile {
namespace {

class WorkersOfCount : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Threads, WorkersOfCount, testing::Values(1, 2, 3, 8));

TEST_P(WorkersOfCount, EachPartIsDoneOnceInEveryCall) {
  Workers workers(GetParam());
  for (int round = 0; round < 2000; ++round) {
    const int parts = round % 37;
    std::vector<std::atomic<int>> done(static_cast<std::size_t>(parts));
    workers.run(parts, [&](int part) { ++done[static_cast<std::size_t>(part)]; });
    for (const std::atomic<int>& count : done) ASSERT_EQ(count, 1) << "round " << round;
  }
}

TEST_P(WorkersOfCount, WhatPartsWroteIsSeenByTheNextCall) {
  Workers workers(GetParam());
  std::vector<double> a(999, 1), b(999);
  for (int round = 0; round < 500; ++round) {
    share_out(&workers, 999, [&](int begin, int end) {
      for (int k = begin; k < end; ++k) b[static_cast<std::size_t>(k)] = a[static_cast<std::size_t>(998 - k)] + 1;
    });
    std::swap(a, b);
  }
  for (const double value : a) ASSERT_EQ(value, 501);
}

TEST_P(WorkersOfCount, TheExceptionOfTheLowestPartArrivesAfterTheOthersAreDone) {
  Workers workers(GetParam());
  for (int round = 0; round < 50; ++round) {
    std::atomic<int> done = 0;
    try {
      workers.run(40, [&](int part) {
        if (part % 10 == 7) throw std::runtime_error(std::to_string(part));
        ++done;
      });
      FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "7");
    }
    ASSERT_EQ(done, 36);
  }
}

TEST_P(WorkersOfCount, SumsOfPiecesHaveTheBitsOfOneThread) {
  constexpr int count = 20 * piece_size + 17;
  const auto sum = [](Workers* workers) {
    std::vector<double> sums(static_cast<std::size_t>(pieces(count)));
    share_pieces(workers, count, [&](int piece, int begin, int end) {
      for (int k = begin; k < end; ++k) sums[static_cast<std::size_t>(piece)] += std::sin(k);
    });
    return std::accumulate(sums.begin(), sums.end(), 0.0);
  };
  Workers workers(GetParam());
  for (int k = 0; k < 20; ++k) EXPECT_EQ(sum(&workers), sum(nullptr));
}

TEST_P(WorkersOfCount, ACallFromWithinABodyIsDone) {
  Workers workers(GetParam());
  std::atomic<int> done = 0;
  workers.run(5, [&](int) { workers.run(7, [&](int) { ++done; }); });
  EXPECT_EQ(done, 35);
}

// As where the system gives another thread no processor: it must not matter which thread, nor for how long.
TEST(Workers, ThreadsThatAreHeldUpLeaveTheOtherPartsToTheCaller) {
  Workers workers(3);
  const std::thread::id caller = std::this_thread::get_id();
  constexpr int parts = 50;
  for (int round = 0; round < 100; ++round) {
    std::atomic<int> begun = 0;
    workers.run(parts, [&](int) {
      ++begun;
      while (std::this_thread::get_id() != caller && begun < parts) std::this_thread::yield();
    });
    EXPECT_EQ(begun, parts);
  }
}

TEST(Workers, TwoCallersAtOnceBothGetTheirParts) {
  Workers workers(2);
  std::vector<std::atomic<int>> done(2);
  const auto call = [&](std::size_t caller) {
    for (int round = 0; round < 500; ++round) workers.run(9, [&](int) { ++done[caller]; });
  };
  std::thread other([&] { call(1); });
  call(0);
  other.join();
  EXPECT_EQ(done[0], 4500);
  EXPECT_EQ(done[1], 4500);
}

}  // namespace
}  // namespace toile
