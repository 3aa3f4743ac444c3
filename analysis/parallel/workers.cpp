// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/parallel/workers.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include <chrono>
#include <system_error>

namespace toile {
namespace {

// A step's next piece of work is often nearer than this, and waking takes about as long. Not more: where others want
// the processor, a thread that spins uses up its time, and then waits when there is work.
constexpr std::chrono::microseconds spin(20);
constexpr int looks = 16;  // at the value from one look at the clock to the next

// Returns when `value` is no longer `old`.
template <class T>
void wait_while(const std::atomic<T>& value, T old) {
  for (const auto begin = std::chrono::steady_clock::now(); std::chrono::steady_clock::now() - begin < spin;) {
    for (int k = 0; k < looks; ++k) {
      if (value.load(std::memory_order_acquire) != old) return;
#if defined(__x86_64__)
      _mm_pause();
#endif
    }
  }
  value.wait(old, std::memory_order_acquire);
}

constexpr std::uint64_t parts_left(int first, int end) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(first)) | static_cast<std::uint64_t>(end) << 32u;
}
constexpr int first_of(std::uint64_t left) {
  return static_cast<int>(left & 0xffffffffu);
}
constexpr int end_of(std::uint64_t left) {
  return static_cast<int>(left >> 32u);
}

}  // namespace

Workers::Workers(int count) {
  try {
    for (int k = 1; k < count; ++k) threads_.emplace_back([this] { work(); });
  } catch (const std::system_error&) {
  }
}

Workers::~Workers() {
  end_ = true;
  call_up();
  for (std::thread& thread : threads_) thread.join();
}

void Workers::Job::do_part(int part) {
  try {
    call(body, part);
  } catch (...) {
    const std::lock_guard lock(mutex);
    if (failed < 0 || part < failed) {
      failed = part;
      error = std::current_exception();
    }
  }
}

void Workers::run(Job& job) {
  if (!threads_.empty() && job.parts > 1 && !taken_.exchange(true, std::memory_order_acquire)) {
    share(job);
    taken_.store(false, std::memory_order_release);
  } else {
    for (int part = 0; part < job.parts; ++part) job.do_part(part);
  }
  if (job.error) std::rethrow_exception(job.error);
}

void Workers::share(Job& job) {
  job_ = &job;
  done_by_others_.store(0, std::memory_order_relaxed);
  left_.store(parts_left(0, job.parts), std::memory_order_release);
  call_up();
  int own = 0;
  for (int part = take_first(); part >= 0; part = take_first(), ++own) job.do_part(part);
  await_others(job.parts - own);
}

void Workers::call_up() {
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
}

void Workers::await_others(int others) {
  for (int done; (done = done_by_others_.load(std::memory_order_acquire)) != others;) wait_while(done_by_others_, done);
}

// The caller takes the first part that is left, the others the last: so each thread tends to do the parts that it did
// before, whose data are near it. A taken part keeps its job alive, as the call waits for it; and whoever takes one of
// this round sees its job, whatever was seen before.
int Workers::take_first() {
  std::uint64_t left = left_.load(std::memory_order_relaxed);
  while (first_of(left) < end_of(left)) {
    if (left_.compare_exchange_weak(left, parts_left(first_of(left) + 1, end_of(left)), std::memory_order_relaxed))
      return first_of(left);
  }
  return -1;
}

int Workers::take_last() {
  std::uint64_t left = left_.load(std::memory_order_relaxed);
  while (first_of(left) < end_of(left)) {
    if (left_.compare_exchange_weak(left, parts_left(first_of(left), end_of(left) - 1), std::memory_order_acquire))
      return end_of(left) - 1;
  }
  return -1;
}

void Workers::work() {
  for (unsigned seen = 0;;) {
    for (int part = take_last(); part >= 0; part = take_last()) {
      job_->do_part(part);
      done_by_others_.fetch_add(1, std::memory_order_release);
      done_by_others_.notify_one();
    }
    wait_while(round_, seen);
    if (end_) return;
    seen = round_.load(std::memory_order_acquire);
  }
}

}  // namespace toile
