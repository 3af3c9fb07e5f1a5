// Values of a Lua table, read without calling into Lua and checked one by one.
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

#include "core/lua/lua_state.h"
#include "core/math/vec3.h"

namespace sim {

// Throws Error{kScene}.
[[noreturn]] void scene_error(const SourceLocation& where, const std::string& what,
                              const std::string& why, const std::string& remedy = {});

// Returns make(); an error that it throws becomes an error of the scene at this source location.
template <class Make>
auto of_scene(const SourceLocation& where, Make make) {
  try {
    return make();
  } catch (const Error& error) {
    scene_error(where, error.text().what, error.text().why, error.text().remedy);
  }
}

// Room on the stack of Lua for what is pushed in its lifetime, which is popped with it. Objects end
// in the reverse order of their making.
class StackScope {
 public:
  explicit StackScope(lua_State* L) : L_(L), top_(lua_gettop(L)) { require_room(L); }
  ~StackScope() { lua_settop(L_, top_); }
  StackScope(const StackScope&) = delete;
  StackScope& operator=(const StackScope&) = delete;

  // Room for the next few values, for a function that leaves them on the stack.
  static void require_room(lua_State* L) { luaL_checkstack(L, LUA_MINSTACK, "reading values"); }

 private:
  lua_State* L_;
  int top_;
};

// A value in a few words for an error: "-1", "'abc'", "nothing", "a table".
std::string show(lua_State* L, int index);

// Pushes table[key] without metamethods and returns its type.
int push_field(lua_State* L, int table, const char* key);

// Each throws Error{kScene} with "bad WHAT: PLACE: expected ..., got ...".
double read_number(lua_State* L, int index, const SourceLocation& place,
                   const std::string& what);  // finite
// ... text that can be shown everywhere: is_visible.
std::string read_text(lua_State* L, int index, const SourceLocation& place,
                      const std::string& what);
Vec3 read_vector(lua_State* L, int index, const SourceLocation& place, const std::string& what);

// The length of a table with the keys 1 .. n and no others.
std::size_t read_length(lua_State* L, int index, const SourceLocation& place,
                        const std::string& what);

// The keys of a table, sorted; each must be text and known.
std::vector<std::string> read_keys(lua_State* L, int index, const std::vector<std::string>& known,
                                   const SourceLocation& place, const std::string& what);

}  // namespace sim
