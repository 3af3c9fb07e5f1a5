// Tables that the scene language made itself, read without checks: what is missing counts as 0.
#pragma once

#include "core/lua/lua_read.h"

namespace sim {

// A table on the stack of Lua. Values that are pushed during the lifetime of the object are popped
// with it, so objects have to be destroyed in the reverse order of construction.
class LuaTable {
 public:
  LuaTable(lua_State* L, int index) : L_(L), scope_(L), index_(lua_absindex(L, index)) {}

  int index() const { return index_; }
  lua_Integer length() const { return static_cast<lua_Integer>(lua_rawlen(L_, index_)); }

  // The table at a key; pushed.
  LuaTable table(const char* key) const { return {L_, index_, key}; }

  lua_Integer integer(const char* key) const {
    const StackScope scope(L_);
    push_field(L_, index_, key);
    return lua_tointeger(L_, -1);
  }
  double number(const char* key) const {
    const StackScope scope(L_);
    push_field(L_, index_, key);
    return lua_tonumber(L_, -1);
  }
  bool flag(const char* key) const {
    const StackScope scope(L_);
    push_field(L_, index_, key);
    return lua_toboolean(L_, -1) != 0;
  }
  // {x, y, z} at a key.
  Vec3 vector(const char* key) const {
    const LuaTable v = table(key);
    return {v.number(1), v.number(2), v.number(3)};
  }

  // The i-th number of a list; `otherwise` where there is none.
  double number(lua_Integer i, double otherwise = 0) const {
    const double value =
        lua_rawgeti(L_, index_, i) == LUA_TNUMBER ? lua_tonumber(L_, -1) : otherwise;
    lua_pop(L_, 1);
    return value;
  }
  lua_Integer integer(lua_Integer i) const { return static_cast<lua_Integer>(number(i)); }

 private:
  LuaTable(lua_State* L, int parent, const char* key) : L_(L), scope_(L) {
    push_field(L, parent, key);
    index_ = lua_gettop(L);
  }

  lua_State* L_;
  StackScope scope_;
  int index_;
};

}  // namespace sim
