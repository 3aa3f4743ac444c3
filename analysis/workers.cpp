#include "analysis/workers.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include <chrono>
#include <system_error>

namespace toile {
namespace {

// Waking takes up to half of this, and a step's next piece of work is often nearer. Not more: where others
// want the core too, one that spins is the first to wait, and all wait for it.
constexpr std::chrono::microseconds spin(500);
constexpr int looks = 50;  // at the value from one look at the clock to the next

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

}  // namespace

Workers::Workers(int count) {
  try {
    for (int part = 1; part < count; ++part) threads_.emplace_back([this, part] { work(part); });
  } catch (const std::system_error&) {
  }
}

Workers::~Workers() {
  end_ = true;
  start();
  for (std::thread& thread : threads_) thread.join();
}

void Workers::start() {
  busy_.store(static_cast<int>(threads_.size()), std::memory_order_relaxed);
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
}

void Workers::finish() {
  for (int busy = busy_.load(std::memory_order_acquire); busy != 0; busy = busy_.load(std::memory_order_acquire)) {
    wait_while(busy_, busy);
  }
}

void Workers::work(int part) {
  for (unsigned done = 0;; ++done) {
    wait_while(round_, done);
    if (end_) return;
    call_(body_, part);
    if (busy_.fetch_sub(1, std::memory_order_acq_rel) == 1) busy_.notify_one();
  }
}

}  // namespace toile
