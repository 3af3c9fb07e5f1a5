#include "core/c/watcher.h"

#include <algorithm>
#include <ctime>

namespace sim::c {
namespace {

constexpr double kInterval = 0.05;  // s

}  // namespace

double coarse_now() {
#ifdef CLOCK_MONOTONIC_COARSE
  constexpr clockid_t kClock = CLOCK_MONOTONIC_COARSE;
#else
  constexpr clockid_t kClock = CLOCK_MONOTONIC;
#endif
  timespec now{};
  clock_gettime(kClock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Watcher::Watcher(sim_watch watch, void* user, First first)
    : watch_(watch), user_(user), next_(first == First::kAtOnce ? 0 : coarse_now() + kInterval) {}

bool Watcher::stopped(const char* what, double done) {
  if (stopped_ || !watch_ || !is_own_thread()) return stopped_;
  const double now = coarse_now();
  if (now < next_) return false;
  next_ = now + kInterval;
  stopped_ = watch_(user_, what, std::clamp(done, 0.0, 1.0)) != 0;
  return stopped_;
}

}  // namespace sim::c
