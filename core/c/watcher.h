// Callbacks of long work: progress, and stopping.
#pragma once

#include <atomic>
#include <thread>

#include "core/c/sim.h"

namespace sim::c {

// A steady clock that is asked often: s, of some milliseconds.
double coarse_now();

// Polls a callback at intervals, on the thread that made it; once told to stop, it stays so.
class Watcher {
 public:
  enum class First { kAtOnce, kLater };  // the first question

  Watcher(sim_watch watch, void* user, First first = First::kAtOnce);

  bool stopped(const char* what, double done);
  bool told() const { return stopped_; }
  bool is_own_thread() const { return std::this_thread::get_id() == owner_; }

 private:
  sim_watch watch_;
  void* user_;
  std::thread::id owner_ = std::this_thread::get_id();
  double next_;  // s, when to ask
  std::atomic<bool> stopped_ = false;
};

}  // namespace sim::c
