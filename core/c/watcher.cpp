#include "core/c/watcher.h"

#include <chrono>

namespace sim::c {

bool Watcher::stopped(const char* what, double done) {
  constexpr std::int64_t kInterval = 50'000'000;  // ns
  if (stopped_ || !watch_ || std::this_thread::get_id() != owner_) return stopped_;
  const std::int64_t now = std::chrono::steady_clock::now().time_since_epoch().count();
  if (last_ >= 0 && now - last_ < kInterval) return false;
  last_ = now;
  stopped_ = watch_(user_, what, done) != 0;
  return stopped_;
}

}  // namespace sim::c
