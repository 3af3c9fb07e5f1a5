// The sandbox of a scene: the harmless part of Lua's standard library, made repeatable.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/lua/lua_state.h"

namespace sim {

// Opens base, string, table, math, utf8 and coroutine without everything that reaches files,
// processes, bytecode or the state's inside, and without `print`. `pairs` visits keys in a
// fixed order, and reading an unknown global is an error with the nearest known name.
void open_sandbox(lua_State* L, std::uint64_t seed);

// The keys of a table that are text and short enough to be a name somebody meant, sorted; the first
// few hundred of them that are found.
std::vector<std::string> names_in(lua_State* L, int table);

// math.random while another file runs: starts at `seed`, and gets its old state back at the end.
class RandomScope {
 public:
  RandomScope(lua_State* L, std::uint64_t seed);
  ~RandomScope();
  RandomScope(const RandomScope&) = delete;
  RandomScope& operator=(const RandomScope&) = delete;

 private:
  void* state_ = nullptr;  // of math.random, which the registry keeps alive
  unsigned char saved_[64];
  std::size_t size_ = 0;
};

}  // namespace sim
