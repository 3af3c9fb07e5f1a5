#include "core/base/team.h"

#include <algorithm>
#include <exception>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "core/base/float_control.h"

namespace sim {
namespace {

constexpr std::uint32_t kQuit = ~std::uint32_t{0};
constexpr int kSpins = 500;  // some 20 microseconds

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

Team::Team(int threads) {
  for (int rank = 1; rank < threads; ++rank) threads_.emplace_back([this, rank] { work(rank); });
}

Team::~Team() {
  generation_.store(kQuit, std::memory_order_release);
  generation_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

// What a member throws is thrown by the caller when all have finished; the first of several.
void Team::run_erased(Call call, const void* body) {
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
  running_.store(static_cast<int>(threads_.size()), std::memory_order_relaxed);
  const std::uint32_t next = generation_.load(std::memory_order_relaxed) + 1;
  generation_.store(next == kQuit ? 0 : next, std::memory_order_release);
  generation_.notify_all();
  call_(body_, 0);
  for (int spin = 0; running_.load(std::memory_order_acquire) != 0; ++spin) wait_a_little(spin);
  if (guarded.error) std::rethrow_exception(guarded.error);
}

void Team::work(int rank) {
  const FloatControl control;
  std::uint32_t seen = 0;
  for (;;) {
    std::uint32_t now = seen;
    for (int spin = 0; spin < kSpins && now == seen; ++spin) {
      now = generation_.load(std::memory_order_acquire);
      if (now == seen) relax();
    }
    if (now == seen) {
      generation_.wait(seen, std::memory_order_acquire);
      continue;
    }
    if (now == kQuit) return;
    seen = now;
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
