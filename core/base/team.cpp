#include "core/base/team.h"

#include <algorithm>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace sim {
namespace {

constexpr std::uint32_t kQuit = ~std::uint32_t{0};
constexpr int kSpins = 500;  // some 20 microseconds

void relax() {
#if defined(__x86_64__)
  _mm_pause();
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

void Team::run_erased(Call call, const void* body) {
  call_ = call;
  body_ = body;
  running_.store(static_cast<int>(threads_.size()), std::memory_order_relaxed);
  const std::uint32_t next = generation_.load(std::memory_order_relaxed) + 1;
  generation_.store(next == kQuit ? 0 : next, std::memory_order_release);
  generation_.notify_all();
  call(body, 0);
  for (int spin = 0; running_.load(std::memory_order_acquire) != 0; ++spin) wait_a_little(spin);
}

void Team::work(int rank) {
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
