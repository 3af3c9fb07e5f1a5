// A thread pool: persistent threads that run one function on every member.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

#include "core/base/cancellation.h"

namespace sim {

// The part [begin, end) of n items, in multiples of `grain`, that falls to one rank of a pool.
struct Part {
  int begin, end;
};
Part part_of(int n, int grain, int rank, int ranks);

// Member 0 is the caller. A run costs a fraction of a microsecond while the members spin; idle
// members go to sleep after some microseconds, so that a busy machine is not held up, and those
// that are not used sleep until they are.
class ThreadPool {
 public:
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int most() const noexcept { return static_cast<int>(threads_.size()) + 1; }
  int size() const noexcept { return size_; }  // that are used: all, until use() says otherwise
  void use(int size);                          // 1 .. most(); between two runs

  // Calls body(rank) on every member used and returns when all have finished. body must not throw.
  template <class Body>
  void run(const Body& body) {
    if (size_ == 1) return body(0);
    run_erased([](const void* b, int rank) { (*static_cast<const Body*>(b))(rank); }, &body);
  }

  // Runs body(begin, end) on each thread with its part of n items.
  template <class Body>
  void run_parts(int n, int grain, const Body& body) {
    run([&](int rank) {
      const Part part = part_of(n, grain, rank, size());
      body(part.begin, part.end);
    });
  }

  // The same with one item a grain; the caller alone does fewer than `many`.
  template <class Body>
  void run_if_many(int n, int many, const Body& body) {
    if (n < many) return body(0, n);
    run_parts(n, 1, body);
  }

  // The step that runs are parts of, which outlives them; without one none is ever given up.
  void serve(Cancellation& step) { step_ = &step; }
  // Asked by body(rank) between two pieces of its work: true where what it does is worth nothing.
  bool gives_up(int rank) { return step_ && (rank == 0 ? step_->gives_up() : step_->given_up()); }

 private:
  using Call = void (*)(const void* body, int rank);
  void run_erased(Call call, const void* body);
  void work(int rank);

  int size_;
  Call call_ = nullptr;
  const void* body_ = nullptr;
  // The number of the last run, times kMost, and how many members are in it; ~0 = quit. A member
  // that was not in it may sleep through any number of runs.
  alignas(64) std::atomic<std::uint64_t> last_{0};
  alignas(64) std::atomic<int> running_{0}, used_;
  std::vector<std::thread> threads_;
  Cancellation* step_ = nullptr;
};

// The spin-th round of waiting for another thread: it spins at first, then yields its processor,
// which the other thread may need on a busy machine.
void wait_a_little(int spin);

}  // namespace sim
