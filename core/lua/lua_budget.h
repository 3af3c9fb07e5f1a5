// The account of what Lua has taken of its limits, and their enforcement.
#pragma once

#include <pthread.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <lua.hpp>
#include <string>

#include "core/lua/limits.h"

namespace sim {

// Every thread of the Lua state counts its instructions by a hook. Library code that runs long
// without any (patterns, moves of tables, allocation, a tree of coroutines) charges its work. From
// the end of the budget on each further instruction raises an error, so that no pcall can go on.
class LuaBudget {
 public:
  enum class End { kNone, kInterrupted, kTime, kSteps, kMemory };

  LuaBudget(const LuaLimits& limits, std::function<bool()> interrupted);
  LuaBudget(const LuaBudget&) = delete;

  // The budget of the state that L is a thread of.
  static LuaBudget& of(lua_State* L);
  static void* allocate(void* budget, void* block, std::size_t old_size, std::size_t new_size);

  // The serial number of a table, function, userdata or thread in its state; 0 for other values.
  // The same in every process, unlike an address.
  static std::uint64_t serial(lua_State* L, int index);
  void measure_userdata(lua_State* L);  // once, for serial()

  // Around a call from outside; a new account each, but for limits of the run. Where that is used
  // up begin() ends it.
  void begin(lua_State* main);
  void end();

  // Around what is not Lua's own time, in a function that Lua has called. Calls back into Lua have
  // accounts of their own: fresh() begins each.
  struct Aside {
    explicit Aside(LuaBudget& budget);
    ~Aside();
    Aside(const Aside&) = delete;

   private:
    LuaBudget& budget_;
    double used_;
    std::uint64_t steps_;
  };
  void fresh();

  // Lua runs in another of its threads.
  struct Thread {
    explicit Thread(lua_State* L);
    ~Thread();
    Thread(const Thread&) = delete;

   private:
    LuaBudget& budget_;
    lua_State* before_;
  };

  // Counts work in units of an instruction; at the end of the budget it raises the error of Lua.
  void charge(lua_State* L, std::uint64_t units) {
    if ((pending_ += units) >= kTick) settle(L);
  }
  void check(lua_State* L) {
    if (ended_ != End::kNone) raise_end(L);
  }
  End ended() const { return ended_; }
  // True for a thread that was stopped by the end of a budget, in which nothing may run any more.
  static bool spoiled(lua_State* thread);

  // The error to throw after the end of the budget; at `place` where no line is known.
  ErrorText error(const std::string& place) const;
  // The error to throw where Lua was refused memory and could not be told.
  ErrorText memory_error(const std::string& place) const;
  // From another thread: has one call taken so much longer than it may that it cannot be stopped?
  // To be asked every second or so.
  bool stuck();
  ErrorText stuck_error() const;

 private:
  static constexpr std::uint64_t kTick = 1000;  // instructions between two looks
  using Clock = std::chrono::steady_clock;

  static void hook(lua_State* L, lua_Debug* event);
  void arm(lua_State* L, int count) const;
  void flip();
  void settle(lua_State* L);
  void take(lua_State* L, std::uint64_t units);
  bool slow(double passed);
  void look_at_clock(lua_State* L);
  void stop(lua_State* L, End end);
  [[noreturn]] void raise_end(lua_State* L) const;
  void note_string(std::size_t size);
  void note_refusal(bool by_limit);
  double used() const;
  ErrorText time_error(const std::string& where) const;
  LuaLimits limits_;
  std::function<bool()> interrupted_;
  std::size_t memory_ = 0, refused_ = 0;  // bytes
  std::string refused_at_;                // the location in the scene, by the limit or the system
  bool by_limit_ = false;
  std::uint64_t objects_ = 0;           // made so far
  const char* newest_ = nullptr;        // of them
  std::ptrdiff_t userdata_offset_ = 0;  // bytes, offset of the contents of a userdata
  lua_State *main_ = nullptr, *running_ = nullptr;
  End ended_ = End::kNone;
  std::string place_;
  std::uint64_t steps_ = 0, pending_ = 0, allocated_ = 0;
  int interval_ = kTick, longest_interval_ = kTick;  // instructions between two looks
  bool timed_ = false, clocked_ = false,
       suspected_ = false;  // deadline_, start_, slow_since_ known
  Clock::time_point last_, deadline_;
  double start_ = 0, before_ = 0, slow_since_ = 0;  // s of processor time
  Clock::time_point entered_;
  double spent_ = 0, born_ = 0;  // s, by earlier calls of the run; of the process, when it began
  std::atomic<std::uint64_t> entries_{0};  // odd inside; read by the watchdog, as is the next
  std::atomic<pthread_t> thread_{};
  std::uint64_t seen_ = 0;  // by the watchdog, and since what time of the thread
  double seen_at_ = 0;
};

}  // namespace sim
