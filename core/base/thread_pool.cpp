#include "core/base/thread_pool.h"

#include <algorithm>
#include <exception>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "core/base/float_control.h"
#include "core/base/thread_start.h"

namespace sim {
namespace {

constexpr std::uint64_t kQuit = ~std::uint64_t{0};
constexpr std::uint64_t kMost = 1 << 16;  // members
constexpr int kSpins = 500;               // some 20 microseconds

void relax() {
#if defined(__x86_64__)
  _mm_pause();
#elif defined(__aarch64__)
  __asm__ volatile("yield");
#endif
}

}  // namespace

void wait_a_little(int spin) {
  if (spin < kSpins)
    relax();
  else
    std::this_thread::yield();
}

ThreadPool::ThreadPool(int threads) : size_(std::max(1, threads)), used_(size_) {
  threads_.reserve(static_cast<std::size_t>(size_));
  for (int rank = 1; rank < threads; ++rank) {
    std::thread thread;
    if (!start_thread(thread, [this, rank] { work(rank); })) break;
    threads_.push_back(std::move(thread));
  }
  use(most());
}

ThreadPool::~ThreadPool() {
  last_.store(kQuit, std::memory_order_release);
  last_.notify_all();
  use(most());
  for (std::thread& thread : threads_) thread.join();
}

void ThreadPool::use(int size) {
  size_ = size;
  used_.store(size, std::memory_order_release);
  used_.notify_all();
}

// An exception of a member is rethrown by the caller when all have finished; the first of several.
void ThreadPool::run_erased(Call call, const void* body) {
  struct Guarded {
    Call call;
    const void* body;
    std::atomic_flag failed{};
    std::exception_ptr error{};
  } guarded{call, body};
  call_ = [](const void* data, int rank) {
    auto& inner = *static_cast<Guarded*>(const_cast<void*>(data));
    try {
      inner.call(inner.body, rank);
    } catch (...) {
      if (!inner.failed.test_and_set()) inner.error = std::current_exception();
    }
  };
  body_ = &guarded;
  running_.store(size_ - 1, std::memory_order_relaxed);
  const std::uint64_t run = last_.load(std::memory_order_relaxed) / kMost + 1;
  last_.store(run * kMost + static_cast<std::uint64_t>(size_), std::memory_order_release);
  last_.notify_all();
  call_(body_, 0);
  for (int spin = 0; running_.load(std::memory_order_acquire) != 0; ++spin) wait_a_little(spin);
  if (guarded.error) std::rethrow_exception(guarded.error);
}

void ThreadPool::work(int rank) {
  const FloatControl control;
  std::uint64_t seen = 0;
  for (;;) {
    std::uint64_t now = seen;
    const int used = used_.load(std::memory_order_acquire);
    for (int spin = 0; spin < kSpins && now == seen && rank < used; ++spin) {
      now = last_.load(std::memory_order_acquire);
      if (now == seen) relax();
    }
    if (now == seen) {
      if (rank < used)
        last_.wait(seen, std::memory_order_acquire);
      else
        used_.wait(used, std::memory_order_acquire);
      continue;
    }
    if (now == kQuit) return;
    seen = now;
    if (static_cast<std::uint64_t>(rank) >= now % kMost) continue;
    call_(body_, rank);
    control.restore();
    running_.fetch_sub(1, std::memory_order_release);
  }
}

Part part_of(int n, int grain, int rank, int ranks) {
  const std::int64_t grains = (static_cast<std::int64_t>(n) + grain - 1) / grain;
  const auto cut = [&](int r) {
    return static_cast<int>(std::min<std::int64_t>(n, grains * r / ranks * grain));
  };
  return {cut(rank), cut(rank + 1)};
}

}  // namespace sim
