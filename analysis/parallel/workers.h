// SPDX-License-Identifier: GPL-3.0-or-later
// A pool of threads that do the parts of one piece of work together.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace toile {

class Workers {
 public:
  // `count` threads with the caller's, or fewer where the system gives no more. Between calls they sleep.
  explicit Workers(int count);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  int count() const { return static_cast<int>(threads_.size()) + 1; }

  // body(part) once for each part of [0, parts), on any thread, in any order; returns when all are done.
  //   (1) The caller takes every part that no other thread has begun, so a thread that gets no processor delays
  //       nothing.
  //   (2) Where bodies throw, the other parts are still done; then the exception of the lowest part is thrown here, and
  //       the pool stays usable.
  //   (3) A call from within a body, or during another thread's call, does all its parts on its own thread.
  // Results have the same bits for any number of threads if what a part computes depends on the part alone.
  template <class Body>
  void run(int parts, const Body& body) {
    Job job;
    job.call = [](const void* b, int part) { (*static_cast<const Body*>(b))(part); };
    job.body = &body;
    job.parts = parts;
    run(job);
  }

 private:
  struct Job {
    void (*call)(const void*, int) = nullptr;
    const void* body = nullptr;
    int parts = 0;
    std::mutex mutex;  // of the two below
    int failed = -1;   // lowest part that threw
    std::exception_ptr error;

    void do_part(int part);
  };

  void run(Job& job);
  void share(Job& job);
  void call_up();
  void await_others(int others);
  void work();
  int take_first();
  int take_last();

  std::vector<std::thread> threads_;
  std::atomic<bool> taken_{false};  // by a call that shares its parts
  std::atomic<bool> end_{false};
  Job* job_ = nullptr;  // of this round; read only by a thread that has taken a part of it
  static constexpr std::size_t cache_line = 64;
  alignas(cache_line) std::atomic<unsigned> round_{0};      // changes when there are new parts
  alignas(cache_line) std::atomic<std::uint64_t> left_{0};  // parts that nobody has begun: first, end (high half)
  alignas(cache_line) std::atomic<int> done_by_others_{0};  // parts of this round
};

// body(begin, end) over runs of [0, count) that make it up, on several threads; in one run where there are no workers.
template <class Body>
void share_out(Workers* workers, int count, const Body& body) {
  constexpr int runs_per_thread = 4;  // a thread that comes late still finds work, and runs stay long
  if (!workers || workers->count() == 1) return body(0, count);
  const int n = std::min(count, runs_per_thread * workers->count());
  const auto at = [&](int part) { return static_cast<int>(static_cast<long>(count) * part / n); };
  workers->run(n, [&](int part) { body(at(part), at(part + 1)); });
}

// Pieces of a fixed size, body(piece, begin, end): vectorised loops and sums within a piece come out the same to the
// last bit for any number of threads.
constexpr int piece_size = 1024;
constexpr int pieces(int count) {
  return (count + piece_size - 1) / piece_size;
}
template <class Body>
void share_pieces(Workers* workers, int count, const Body& body) {
  const auto piece = [&](int k) { body(k, piece_size * k, std::min(piece_size * (k + 1), count)); };
  if (workers && pieces(count) > 1) return workers->run(pieces(count), piece);
  for (int k = 0; k < pieces(count); ++k) piece(k);
}

}  // namespace toile
