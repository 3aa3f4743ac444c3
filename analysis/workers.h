// A few threads that do the parts of one piece of work at the same time.
#pragma once

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace toile {

// `count` threads, the caller's among them, or fewer where the system gives no more; they sleep in between. One caller
// at a time.
class Workers {
 public:
  explicit Workers(int count);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  int count() const { return static_cast<int>(threads_.size()) + 1; }

  // body(0) here, body(1) to body(count - 1) there; returns when all are done. They must not throw.
  template <class Body>
  void run(const Body& body) {
    call_ = [](const void* b, int part) { (*static_cast<const Body*>(b))(part); };
    body_ = &body;
    start();
    body(0);
    finish();
  }

 private:
  void start();
  void finish();
  void work(int part);

  std::vector<std::thread> threads_;
  void (*call_)(const void*, int) = nullptr;
  const void* body_ = nullptr;
  bool end_ = false;
  std::atomic<unsigned> round_{0};
  std::atomic<int> busy_{0};
};

// body(part, begin, end) of [0, count), a run of it for each thread; on the caller's thread where there are no workers.
template <class Body>
void share_out(Workers* workers, int count, const Body& body) {
  const int n = workers ? workers->count() : 1;
  if (n == 1) return body(0, 0, count);
  const auto at = [&](int part) { return static_cast<int>(static_cast<long>(count) * part / n); };
  workers->run([&](int part) { body(part, at(part), at(part + 1)); });
}

// Pieces of a fixed size, body(piece, begin, end): vectorised loops and sums within a piece come out the same to the
// last bit for any number of threads.
constexpr int piece_size = 1024;
constexpr int pieces(int count) {
  return (count + piece_size - 1) / piece_size;
}
template <class Body>
void share_pieces(Workers* workers, int count, const Body& body) {
  share_out(workers, pieces(count), [&](int, int first, int end) {
    for (int k = first; k < end; ++k) body(k, piece_size * k, std::min(piece_size * (k + 1), count));
  });
}

}  // namespace toile
