// Gives up what runs in Lua and cannot be stopped.
#pragma once

#include <condition_variable>
#include <mutex>
#include <thread>

#include "core/lua/lua_budget.h"

namespace sim {

// A few operations of Lua take as long as they like and ask nobody (collecting a chain of weak
// tables, a chain of __call). A thread looks at the processor time of each call and, some seconds
// after the end of its budget, says so; who hears it ends the process.
// Nothing watches if the system gives no thread.
class Watchdog {
 public:
  Watchdog(LuaBudget& budget, LuaOverrun overrun);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

 private:
  void watch();

  LuaBudget& budget_;
  LuaOverrun overrun_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false;
  std::thread thread_;  // last: it reads the others
};

}  // namespace sim
