// Patterns of Lua (reference manual, 6.4.1), matched with an account of the work.
#pragma once

#include <cstddef>
#include <string_view>

#include "core/lua/library/library.h"

namespace sim {

// One pattern over one subject. Both texts outlive it. Raises errors of Lua: a malformed pattern,
// one too deeply nested, the end of the budget.
class Pattern {
 public:
  Pattern(lua_State* L, std::string_view subject, std::string_view pattern);

  // The end of the match that begins at `at`, or null.
  const char* match(const char* at);

  // Pushes what the pattern captured, or else the whole match (unless there is none, null), and
  // returns how many values.
  int push_captures(const char* begin, const char* end) const;
  // ... one of them, counted from 0.
  void push_capture(int index, const char* begin, const char* end) const;

  const char* begin() const { return begin_; }
  const char* end() const { return end_; }

 private:
  static constexpr int kMostCaptures = 32, kDeepest = 200;
  static constexpr std::ptrdiff_t kOpen = -1, kPlace = -2;  // instead of a length
  struct Capture {
    const char* at;
    std::ptrdiff_t length;
  };
  struct Deeper;

  const char* go(const char* s, const char* p);
  const char* most_first(const char* s, const char* p, const char* item_end);
  const char* least_first(const char* s, const char* p, const char* item_end);
  const char* open(const char* s, const char* p, std::ptrdiff_t kind);
  const char* close(const char* s, const char* p);
  const char* balanced(const char* s, const char* p) const;
  const char* again(const char* s, char digit) const;
  const char* item_end(const char* p) const;
  bool item_has(const char* s, const char* p, const char* item_end) const;
  bool set_has(unsigned char c, const char* set, const char* bracket) const;
  void work() { budget_.charge(L_, 1); }

  lua_State* L_;
  LuaBudget& budget_;
  const char *begin_, *end_, *pattern_, *pattern_end_;
  int captures_ = 0, depth_ = 0;
  Capture capture_[kMostCaptures];
};

}  // namespace sim
