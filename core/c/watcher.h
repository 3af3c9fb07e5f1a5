// Callbacks of long work: progress, and stopping.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

#include "core/c/sim.h"

namespace sim::c {

// Polls a callback at intervals, on the thread that made it; once told to stop, it stays so.
class Watcher {
 public:
  Watcher(sim_watch watch, void* user) : watch_(watch), user_(user) {}

  bool stopped(const char* what, double done);
  bool told() const { return stopped_; }

 private:
  sim_watch watch_;
  void* user_;
  std::thread::id owner_ = std::this_thread::get_id();
  std::int64_t last_ = -1;  // ns, of a clock that is steady
  std::atomic<bool> stopped_ = false;
};

}  // namespace sim::c
