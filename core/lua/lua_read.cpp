#include "core/lua/lua_read.h"

#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/base/utf8.h"

namespace sim {

void scene_error(const SourceLocation& where, const std::string& what, const std::string& why,
                 const std::string& remedy) {
  throw Error(ErrorKind::kScene, {what, where, why, remedy});
}

std::string show(lua_State* L, int index) {
  switch (lua_type(L, index)) {
    case LUA_TNONE:
    case LUA_TNIL:
      return "nothing";
    case LUA_TBOOLEAN:
      return lua_toboolean(L, index) ? "true" : "false";
    case LUA_TNUMBER:
      if (lua_isinteger(L, index)) return std::to_string(lua_tointeger(L, index));
      return std::isnan(lua_tonumber(L, index)) ? "nan" : shortest(lua_tonumber(L, index));
    case LUA_TSTRING: {
      const std::string_view text(lua_tostring(L, index), lua_rawlen(L, index));
      std::string quoted(1, '\'');
      quoted += one_line_text(utf8_head(text, 40));
      return quoted += text.size() > 40 ? "...'" : "'";
    }
    default:
      return std::string("a ") + luaL_typename(L, index);
  }
}

int push_field(lua_State* L, int table, const char* key) {
  StackScope::require_room(L);
  table = lua_absindex(L, table);
  lua_pushstring(L, key);
  return lua_rawget(L, table);
}

double read_number(lua_State* L, int index, const SourceLocation& place, const std::string& what) {
  if (lua_type(L, index) != LUA_TNUMBER || !std::isfinite(lua_tonumber(L, index)))
    scene_error(place, "bad " + what, "expected a finite number, got " + show(L, index));
  return lua_tonumber(L, index);
}

std::string read_text(lua_State* L, int index, const SourceLocation& place,
                      const std::string& what) {
  if (lua_type(L, index) != LUA_TSTRING)
    scene_error(place, "bad " + what, "expected text, got " + show(L, index));
  const std::string text(lua_tostring(L, index), lua_rawlen(L, index));
  if (!is_visible(text))
    scene_error(place, "bad " + what,
                "control characters, marks that reorder text and bytes that are not UTF-8 cannot "
                "stand in it, got " +
                    show(L, index),
                "write it in plain text");
  return text;
}

Vec3 read_vector(lua_State* L, int index, const SourceLocation& place, const std::string& what) {
  if (!lua_istable(L, index))
    scene_error(place, "bad " + what, "expected a vector {x, y, z}, got " + show(L, index));
  if (read_length(L, index, place, what) != 3)
    scene_error(place, "bad " + what,
                "expected a vector of 3 numbers {x, y, z}, got " +
                    std::to_string(lua_rawlen(L, index)) + " values");
  const StackScope scope(L);
  Vec3 vector;
  for (int i = 0; i < 3; ++i) {
    lua_rawgeti(L, index, i + 1);
    vector[i] = read_number(L, -1, place, what);
    lua_pop(L, 1);
  }
  return vector;
}

std::size_t read_length(lua_State* L, int index, const SourceLocation& place,
                        const std::string& what) {
  const StackScope scope(L);
  index = lua_absindex(L, index);
  if (!lua_istable(L, index))
    scene_error(place, "bad " + what, "expected a list, got " + show(L, index));
  const auto length = static_cast<lua_Integer>(lua_rawlen(L, index));
  lua_Integer count = 0;
  for (lua_pushnil(L); lua_next(L, index); lua_pop(L, 1), ++count) {
    if (!lua_isinteger(L, -2))
      scene_error(place, "bad " + what,
                  "expected a list without names, found the key " + show(L, -2));
    if (const lua_Integer key = lua_tointeger(L, -2); key < 1 || key > length)
      scene_error(place, "bad " + what,
                  "expected a list with the places 1, 2, 3, ... and no hole, found the place " +
                      show(L, -2) + " after a hole");
  }
  if (count != length)
    scene_error(place, "bad " + what, "expected a list without holes (nil in it)");
  return static_cast<std::size_t>(length);
}

std::vector<std::string> read_keys(lua_State* L, int index, const std::vector<std::string>& known,
                                   const SourceLocation& place, const std::string& what) {
  const StackScope scope(L);
  index = lua_absindex(L, index);
  std::vector<std::string> keys;
  for (lua_pushnil(L); lua_next(L, index); lua_pop(L, 1)) {
    if (lua_type(L, -2) != LUA_TSTRING)
      scene_error(place, "bad key in " + what,
                  "every entry has a name, found the key " + show(L, -2), suggestion("", known));
    keys.emplace_back(lua_tostring(L, -2), lua_rawlen(L, -2));
  }
  std::sort(keys.begin(), keys.end());
  for (const std::string& key : keys)
    if (std::find(known.begin(), known.end(), key) == known.end())
      scene_error(place, "unknown key '" + one_line_text(key) + "' in " + what,
                  "it is not used there", suggestion(key, known));
  return keys;
}

}  // namespace sim
