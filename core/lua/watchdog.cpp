#include "core/lua/watchdog.h"

#include <csignal>

#include "core/base/thread_start.h"

namespace sim {

// Signals are for the other threads.
Watchdog::Watchdog(LuaBudget& budget, LuaOverrun overrun) : budget_(budget), overrun_(overrun) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  start_thread(thread_, [this] { watch(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

Watchdog::~Watchdog() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void Watchdog::watch() {
  constexpr auto kPeriod = std::chrono::milliseconds(250);
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kPeriod, [this] { return over_; }))
    if (budget_.stuck()) return overrun_(budget_.stuck_error());
}

}  // namespace sim
