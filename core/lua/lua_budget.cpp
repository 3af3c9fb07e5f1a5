#include "core/lua/lua_budget.h"

#include <sys/resource.h>
#include <unistd.h>
#include <ctime>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "core/base/text.h"
#include "core/lua/lua_state.h"

namespace sim {
namespace {

constexpr double kFirstLook = 0.1;  // s; the clock of the processor is asked after them only
constexpr double kGrace = 2;        // s beyond the budget, until a stuck call is given up
constexpr std::size_t kHeader = sizeof(std::uint64_t);  // before each block: the object's serial
constexpr std::size_t kLongString = 100'000;            // bytes
constexpr std::size_t kStepBytes = 64;                  // that cost as much as an instruction
constexpr std::size_t kBatch = std::size_t{1} << 20;    // bytes allocated between two looks

// Half of the memory of this machine, in bytes.
std::size_t half_of_machine() {
  const auto pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
  if (pages <= 0 || page <= 0) return std::size_t{1} << 30;
  return static_cast<std::size_t>(pages) * static_cast<std::size_t>(page) / 2;
}

double seconds_of(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// The innermost line of a scene that runs in a thread.
std::string running_line(lua_State* L) {
  lua_Debug frame;
  for (int level = 0; level < 200 && lua_getstack(L, level, &frame); ++level) {
    lua_getinfo(L, "Sl", &frame);
    if (frame.currentline > 0 && std::strcmp(frame.source, kLanguageSource) != 0)
      return lua_place(frame.source, frame.currentline);
  }
  return {};
}

}  // namespace

LuaBudget::LuaBudget(const LuaLimits& limits, std::function<bool()> interrupted)
    : limits_(limits), interrupted_(std::move(interrupted)) {
  limits_.memory = std::min(limits.memory, half_of_machine());
  born_ = seconds_of(CLOCK_PROCESS_CPUTIME_ID);
}

LuaBudget& LuaBudget::of(lua_State* L) {
  return (*static_cast<LuaState**>(lua_getextraspace(L)))->budget();
}

void LuaBudget::begin(lua_State* main) {
  main_ = running_ = main;
  ended_ = End::kNone;
  refused_ = 0;
  refused_at_.clear();
  const std::uint64_t steps = steps_, pending = pending_;
  fresh();
  // Short calls count on where the last one ended: the hook is not set anew.
  if (!limits_.steps_in_all || lua_gethookcount(main) != interval_) arm(main, interval_);
  if (limits_.steps_in_all) {
    steps_ = steps;
    pending_ = pending;
  }
  if (limits_.seconds_in_all) {
    before_ = spent_;
    entered_ = Clock::now();
    if (spent_ >= limits_.seconds) ended_ = End::kTime;
  }
  place_.clear();
  thread_.store(pthread_self(), std::memory_order_relaxed);
  flip();
}

// A call that was too short for a look at the processor's clock counts by the time of day, in all
// not beyond what the process has used.
void LuaBudget::end() {
  flip();
  if (!limits_.seconds_in_all) return;
  const std::chrono::duration<double> passed = Clock::now() - entered_;
  spent_ = clocked_ ? used() : spent_ + passed.count();
  if (spent_ >= limits_.seconds)
    spent_ = std::min(spent_, seconds_of(CLOCK_PROCESS_CPUTIME_ID) - born_);
}

void LuaBudget::flip() {
  entries_.store(entries_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

void LuaBudget::fresh() {
  steps_ = pending_ = allocated_ = 0;
  before_ = 0;
  timed_ = clocked_ = suspected_ = false;
}

LuaBudget::Aside::Aside(LuaBudget& budget)
    : budget_(budget), used_(budget.used()), steps_(budget.steps_ + budget.pending_) {
  budget_.flip();
  budget_.fresh();
}

LuaBudget::Aside::~Aside() {
  budget_.fresh();
  budget_.before_ = used_;
  budget_.steps_ = steps_;
  budget_.flip();  // odd again
}

LuaBudget::Thread::Thread(lua_State* L) : budget_(of(L)), before_(budget_.running_) {
  budget_.running_ = L;
}

LuaBudget::Thread::~Thread() { budget_.running_ = before_; }

void LuaBudget::arm(lua_State* L, int count) const { lua_sethook(L, hook, LUA_MASKCOUNT, count); }

bool LuaBudget::spoiled(lua_State* thread) {
  const int status = lua_status(thread);
  return status != LUA_OK && status != LUA_YIELD && lua_gethookcount(thread) == 1;
}

// Some threads were armed before the interval changed, or stopped with an earlier account.
void LuaBudget::hook(lua_State* L, lua_Debug* /*event*/) {
  LuaBudget& self = of(L);
  if (self.ended_ == End::kNone) self.take(L, kTick);
  self.check(L);
  if (lua_gethookcount(L) != self.interval_) self.arm(L, self.interval_);
}

void LuaBudget::settle(lua_State* L) {
  const std::uint64_t units = std::exchange(pending_, 0);
  if (ended_ == End::kNone) take(L, units);
  check(L);
}

void LuaBudget::take(lua_State* L, std::uint64_t units) {
  steps_ += units;
  if (interrupted_ && interrupted_()) return stop(L, End::kInterrupted);
  if (limits_.steps > 0 && steps_ > limits_.steps) return stop(L, End::kSteps);
  look_at_clock(L);
}

double LuaBudget::used() const {
  return before_ + (clocked_ ? seconds_of(CLOCK_THREAD_CPUTIME_ID) - start_ : 0);
}

// True if the instructions since the last check took too long, unless the machine was busy
// otherwise: the processor's own clock must confirm it at two checks in a row. (A busy machine must
// not make checks frequent: to change their interval costs a walk over all open calls.)
bool LuaBudget::slow(double passed) {
  constexpr double kSlow = 0.03, kSurely = 1;  // s
  if (passed <= kSlow) return suspected_ = false;
  const double now = seconds_of(CLOCK_THREAD_CPUTIME_ID);
  const bool proven = passed > kSurely || (suspected_ && now - slow_since_ > kSlow);
  suspected_ = true;
  slow_since_ = now;
  return proven;
}

// The time of day first, which costs less to ask. Where instructions take long (they compare long
// strings, or pass a million values) there are fewer of them between two looks.
void LuaBudget::look_at_clock(lua_State* L) {
  constexpr double kQuick = 0.001, kAim = 0.01;  // s
  const auto seconds = [](double s) {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
  };
  const Clock::time_point now = Clock::now();
  const double passed = timed_ ? std::chrono::duration<double>(now - last_).count() : kQuick;
  last_ = now;
  if (interval_ > 1 && slow(passed)) {
    interval_ = std::max(1, static_cast<int>(interval_ * kAim / passed));
    arm(L, interval_);
  } else if (passed < kQuick && interval_ < longest_interval_) {
    interval_ = std::min(longest_interval_, 2 * interval_);
  }
  if (!timed_) {
    timed_ = true;
    deadline_ = now + seconds(std::min(kFirstLook, (limits_.seconds - before_) / 2));
  } else if (now >= deadline_) {
    if (!clocked_) {
      clocked_ = true;
      start_ = seconds_of(CLOCK_THREAD_CPUTIME_ID);
      before_ += std::min(kFirstLook, (limits_.seconds - before_) / 2);
    }
    const double left = limits_.seconds - used();
    if (left <= 0) return stop(L, End::kTime);
    deadline_ = now + seconds(left);
  }
}

void LuaBudget::stop(lua_State* L, End end) {
  if (ended_ != End::kNone) return;
  ended_ = end;
  place_ = running_line(L);
  if (place_.empty() && main_ && L != main_) place_ = running_line(main_);
  arm(L, 1);
}

// The error is a pointer: making it allocates nothing.
void LuaBudget::raise_end(lua_State* L) const {
  arm(L, 1);
  lua_pushlightuserdata(L, const_cast<LuaBudget*>(this));
  lua_error(L);
  std::abort();  // lua_error does not return
}

// Lua asks again for what was refused, after it has collected all garbage.
void* LuaBudget::allocate(void* budget, void* block, std::size_t old_size, std::size_t new_size) {
  LuaBudget& self = *static_cast<LuaBudget*>(budget);
  const bool string = !block && old_size == LUA_TSTRING;  // Lua then passes the kind of object
  const bool object = !block && (old_size == LUA_TTABLE || old_size == LUA_TFUNCTION ||
                                 old_size == LUA_TUSERDATA || old_size == LUA_TTHREAD);
  if (!block) old_size = 0;
  char* const whole = block ? static_cast<char*>(block) - kHeader : nullptr;
  if (new_size == 0) {
    std::free(whole);
    self.memory_ -= old_size;
    return nullptr;
  }
  const std::size_t more = new_size > old_size ? new_size - old_size : 0;
  if (more > self.limits_.memory - self.memory_) {
    if (self.running_ && (self.refused_ == new_size || more > self.limits_.memory))
      self.stop(self.running_, End::kMemory);
    self.refused_ = new_size;
    self.note_refusal(true);
    return nullptr;
  }
  auto* const moved = static_cast<char*>(std::realloc(whole, new_size + kHeader));
  if (!moved) {
    self.note_refusal(false);
    return nullptr;
  }
  if (object) {
    std::memcpy(moved, &++self.objects_, kHeader);
    self.newest_ = moved + kHeader;
  }
  self.memory_ += new_size - old_size;
  if (more > 0) self.refused_ = 0;
  if (string && new_size > kLongString) self.note_string(new_size);
  if ((self.allocated_ += more) > kBatch && self.running_ && self.ended_ == End::kNone)
    self.take(self.running_, std::exchange(self.allocated_, 0) / kStepBytes);
  return moved + kHeader;
}

std::uint64_t LuaBudget::serial(lua_State* L, int index) {
  const int type = lua_type(L, index);
  const void* const shown = lua_topointer(L, index);
  const char* object = static_cast<const char*>(shown);
  if (type == LUA_TFUNCTION) {
    const lua_CFunction function = lua_tocfunction(L, index);
    if (function && reinterpret_cast<const void*>(function) == shown) return 0;  // no object
  } else if (type == LUA_TTHREAD) {
    object -= LUA_EXTRASPACE;
  } else if (type == LUA_TUSERDATA) {
    object -= of(L).userdata_offset_;
  } else if (type != LUA_TTABLE) {
    return 0;
  }
  std::uint64_t serial = 0;
  std::memcpy(&serial, object - kHeader, kHeader);
  return serial;
}

void LuaBudget::measure_userdata(lua_State* L) {
  userdata_offset_ = static_cast<char*>(lua_newuserdatauv(L, 1, 0)) - newest_;
  lua_pop(L, 1);
}

// An instruction may go through all of a string.
void LuaBudget::note_string(std::size_t size) {
  constexpr std::size_t kBytes = 100'000'000;  // between two looks
  longest_interval_ =
      std::min(longest_interval_, static_cast<int>(std::max<std::size_t>(1, kBytes / size)));
  if (interval_ <= longest_interval_) return;
  interval_ = longest_interval_;
  if (running_ && ended_ == End::kNone) arm(running_, interval_);
}

void LuaBudget::note_refusal(bool by_limit) {
  by_limit_ = by_limit;
  if (running_) refused_at_ = running_line(running_);
}

ErrorText LuaBudget::memory_error(const std::string& place) const {
  const std::string& where = refused_at_.empty() ? place : refused_at_;
  if (by_limit_) {
    const std::size_t mega = std::max<std::size_t>(1, limits_.memory >> 20);
    return {"out of memory", where,
            "the scene needs more than " + std::to_string(mega) + " MB in Lua",
            "use sim.grid for large regular scenes, or allow more: --lua-budget memory=" +
                std::to_string(4 * mega)};
  }
  rlimit limit{};
  const bool limited = ::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
  return {"out of memory", where,
          limited ? "the program may have " + std::to_string(limit.rlim_cur >> 20) +
                        " MB, and Lua needs more"
                  : "the system has no more for Lua",
          limited ? "make the scene smaller, or allow more: ulimit -v" : "make the scene smaller"};
}

ErrorText LuaBudget::time_error(const std::string& where) const {
  const std::string allow = brief(std::max(60.0, 6 * limits_.seconds));
  return {
      "Lua takes too long", where,
      "it has run for " + brief(limits_.seconds) + (limits_.seconds_in_all ? " s in all" : " s"),
      "look for a loop without end, or allow more: --lua-budget time=" + allow};
}

ErrorText LuaBudget::error(const std::string& place) const {
  const std::string& where = place_.empty() ? place : place_;
  switch (ended_) {
    case End::kInterrupted:
      return {"Lua error", where, kInterrupted, ""};
    case End::kSteps:
      return {"Lua takes too long", where,
              "it has made " + brief(static_cast<double>(limits_.steps)) +
                  (limits_.steps_in_all ? " steps in all" : " steps"),
              "look for a loop without end, or allow more: --lua-budget steps=" +
                  brief(10 * static_cast<double>(limits_.steps))};
    case End::kMemory:
      return memory_error(where);
    default:
      return time_error(where);
  }
}

bool LuaBudget::stuck() {
  const std::uint64_t entry = entries_.load(std::memory_order_relaxed);
  clockid_t clock;
  if (entry % 2 == 0 ||
      pthread_getcpuclockid(thread_.load(std::memory_order_relaxed), &clock) != 0) {
    seen_ = 0;
    return false;
  }
  const double now = seconds_of(clock);
  if (entry != seen_) {
    seen_ = entry;
    seen_at_ = now;
  }
  return now - seen_at_ > limits_.seconds + kGrace;
}

ErrorText LuaBudget::stuck_error() const { return time_error(running_line(running_)); }

}  // namespace sim
