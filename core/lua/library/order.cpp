// The order in which entries of a table are visited, and how values without a text are named: the
// same in every process, whatever the addresses.
#include "core/lua/library/order.h"

#include <algorithm>
#include <new>
#include <string_view>

namespace sim {
namespace {

constexpr const char* kVisits = "sim.visits";      // registry: table -> state of `next`
constexpr const char* kBuiltins = "sim.builtins";  // registry: function of the library -> its name

// The rank of a key among others, and its place among those of its rank.
struct Key {
  enum Rank { kNumber, kText, kFlag, kBuiltin, kObject } rank = kObject;
  double number = 0;
  lua_Integer whole = 0;  // of a number that is one
  std::uint64_t serial = 0;
  std::string_view text{};  // kept alive by the table
  lua_Integer index = 0;    // in a list of keys, from 1

  bool before(const Key& other, lua_State* L) const {
    charge(L, 2);
    if (rank != other.rank) return rank < other.rank;
    if (rank == kNumber)
      return number != other.number ? number < other.number : whole < other.whole;
    if (rank == kObject || rank == kFlag) return serial < other.serial;
    charge(L, std::min(text.size(), other.text.size()) / 64);
    return text < other.text;
  }
};

std::string_view text_at(lua_State* L, int index) {
  std::size_t length = 0;
  const char* const text = lua_tolstring(L, index, &length);
  return {text, length};
}

// The name of a function of the library that is no object; pushed and popped, but it stays in the
// registry.
std::string_view builtin_name(lua_State* L, int index) {
  index = lua_absindex(L, index);
  lua_getfield(L, LUA_REGISTRYINDEX, kBuiltins);
  lua_pushvalue(L, index);
  const bool known = lua_rawget(L, -2) == LUA_TSTRING;
  const std::string_view name = known ? text_at(L, -1) : "builtin";
  lua_pop(L, 2);
  return name;
}

Key key_at(lua_State* L, int index) {
  Key key;
  switch (lua_type(L, index)) {
    case LUA_TNUMBER:
      key.rank = Key::kNumber;
      key.number = lua_tonumber(L, index);
      key.whole = lua_tointeger(L, index);
      break;
    case LUA_TSTRING:
      key.rank = Key::kText;
      key.text = text_at(L, index);
      break;
    case LUA_TBOOLEAN:
      key.rank = Key::kFlag;
      key.serial = static_cast<std::uint64_t>(lua_toboolean(L, index));
      break;
    default:
      key.serial = LuaBudget::serial(L, index);
      if (key.serial == 0) {
        key.rank = Key::kBuiltin;
        key.text = builtin_name(L, index);
      }
  }
  return key;
}

// Pushes a list of the keys of the table at `table` in order.
std::size_t push_keys(lua_State* L, int table) {
  luaL_checkstack(L, LUA_MINSTACK, "visiting a table");
  const int found = lua_gettop(L) + 1, sorted = found + 1;
  lua_newtable(L);
  lua_Integer count = 0;
  for (lua_pushnil(L); lua_next(L, table); lua_pop(L, 1)) {
    charge(L, 4);
    lua_pushvalue(L, -2);
    lua_rawseti(L, found, ++count);
  }
  // In memory of Lua, which counts.
  const auto size = static_cast<std::size_t>(count);
  auto* const keys = static_cast<Key*>(lua_newuserdatauv(L, size * sizeof(Key) + 1, 0));
  for (lua_Integer i = 1; i <= count; ++i) {
    lua_rawgeti(L, found, i);
    Key& key = *new (keys + i - 1) Key(key_at(L, -1));
    key.index = i;
    lua_pop(L, 1);
  }
  const auto before = [L](const Key& a, const Key& b) { return a.before(b, L); };
  if (!std::is_sorted(keys, keys + size, before)) std::sort(keys, keys + size, before);
  lua_createtable(L, static_cast<int>(std::min<std::size_t>(size, 1 << 20)), 0);
  for (std::size_t i = 0; i < size; ++i) {
    lua_rawgeti(L, found, keys[i].index);
    lua_rawseti(L, sorted + 1, static_cast<lua_Integer>(i) + 1);
  }
  lua_replace(L, found);
  lua_settop(L, found);
  return size;
}

// From the position on in a list of keys, the first one that has a value: pushes both. 0 when there
// is none.
lua_Integer push_entry(lua_State* L, int table, int keys, lua_Integer position) {
  while (lua_rawgeti(L, keys, ++position) != LUA_TNIL) {
    lua_pushvalue(L, -1);
    if (lua_rawget(L, table) != LUA_TNIL) return position;
    lua_pop(L, 2);
  }
  lua_pop(L, 1);
  return 0;
}

// Upvalues: the keys in order, the position in them. Values set to nil meanwhile are passed over.
int next_in_order(lua_State* L) {
  lua_settop(L, 2);
  lua_pushvalue(L, lua_upvalueindex(1));
  const lua_Integer position = push_entry(L, 1, 3, lua_tointeger(L, lua_upvalueindex(2)));
  if (position == 0) {
    lua_pushnil(L);
    return 1;
  }
  lua_pushinteger(L, position);
  lua_replace(L, lua_upvalueindex(2));
  return 2;
}

// Lua's own order of text keys differs in every process: here numbers ascend, then text, true and
// false, functions of the library by name, and all else in the order in which it was made.
int ordered_pairs(lua_State* L) {
  luaL_checkany(L, 1);
  if (luaL_getmetafield(L, 1, "__pairs") != LUA_TNIL) {
    lua_pushvalue(L, 1);
    lua_call(L, 1, 3);
    return 3;
  }
  luaL_checktype(L, 1, LUA_TTABLE);
  lua_settop(L, 1);
  push_keys(L, 1);
  lua_pushinteger(L, 0);
  lua_pushcclosure(L, next_in_order, 2);
  lua_pushvalue(L, 1);
  lua_pushnil(L);
  return 3;
}

// The first key of a table that is at 1, without a list of all.
int first_entry(lua_State* L) {
  constexpr int kFirst = 2;
  lua_settop(L, 1);
  lua_pushnil(L);
  Key first;
  for (lua_pushnil(L); lua_next(L, 1); lua_pop(L, 1)) {
    charge(L, 2);
    const Key key = key_at(L, -2);
    if (!lua_isnil(L, kFirst) && !key.before(first, L)) continue;
    first = key;
    lua_pushvalue(L, -2);
    lua_replace(L, kFirst);
  }
  if (lua_isnil(L, kFirst)) return 1;
  lua_pushvalue(L, kFirst);
  lua_rawget(L, 1);
  return 2;
}

// `next` has no memory of its own. Its state for each table is kept until it reaches the end or the
// table is gone: { first = the first key, keys = all in order, at = position of the last one }. The
// keys are listed when the second one is asked for, for many ask for the first one alone.
constexpr int kVisit = 3;  // on the stack, behind the table and the key

void push_new_visit(lua_State* L, int visits) {
  lua_createtable(L, 0, 3);
  lua_pushvalue(L, 1);
  lua_pushvalue(L, -2);
  lua_rawset(L, visits);
}

void end_visit(lua_State* L) {
  lua_getfield(L, LUA_REGISTRYINDEX, kVisits);
  lua_pushvalue(L, 1);
  lua_pushnil(L);
  lua_rawset(L, -3);
}

// Puts the visit of the table at 1 behind the key.
void push_visit(lua_State* L) {
  lua_settop(L, 2);
  lua_getfield(L, LUA_REGISTRYINDEX, kVisits);
  lua_pushvalue(L, 1);
  if (lua_rawget(L, 3) != LUA_TTABLE) {
    lua_pop(L, 1);
    push_new_visit(L, 3);
  }
  lua_replace(L, kVisit);
}

void push_part(lua_State* L, const char* name) {
  lua_pushstring(L, name);
  lua_rawget(L, kVisit);
}

// Pops it.
void set_part(lua_State* L, const char* name) {
  lua_pushstring(L, name);
  lua_insert(L, -2);
  lua_rawset(L, kVisit);
}

// The first place in a list of keys whose key is not before the one at 2.
lua_Integer place_of(lua_State* L, int keys) {
  const Key wanted = key_at(L, 2);
  lua_Integer low = 1, high = static_cast<lua_Integer>(lua_rawlen(L, keys)) + 1;
  while (low < high) {
    const lua_Integer middle = low + (high - low) / 2;
    lua_rawgeti(L, keys, middle);
    const bool before = key_at(L, -1).before(wanted, L);
    lua_pop(L, 1);
    if (before)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

bool is_key(lua_State* L, int keys, lua_Integer place) {
  lua_rawgeti(L, keys, place);
  const bool same = lua_rawequal(L, -1, 2);
  lua_pop(L, 1);
  return same;
}

// The position of the key at 2 in the list of keys at 4, where the last one is mostly; or of the
// one before it, where it is the first one and has been removed; or else -1.
lua_Integer position_of(lua_State* L, int keys) {
  push_part(L, "at");
  const lua_Integer last = lua_tointeger(L, -1);
  lua_pop(L, 1);
  if (last > 0 && is_key(L, keys, last)) return last;
  const lua_Integer place = place_of(L, keys);
  if (is_key(L, keys, place)) return place;
  push_part(L, "first");
  const bool first = lua_rawequal(L, -1, 2);
  lua_pop(L, 1);
  return first ? place - 1 : -1;
}

int ordered_next(lua_State* L) {
  constexpr std::uint64_t kWork = 8;
  constexpr int kKeys = 4;
  charge(L, kWork);
  luaL_checktype(L, 1, LUA_TTABLE);
  lua_settop(L, 2);
  if (lua_isnil(L, 2)) {  // whoever begins anew may have changed the table
    if (first_entry(L) < 2) {
      end_visit(L);
      lua_pushnil(L);
      return 1;
    }
    const int value = lua_gettop(L), key = value - 1;
    lua_getfield(L, LUA_REGISTRYINDEX, kVisits);
    lua_pushvalue(L, 1);
    lua_createtable(L, 0, 3);
    lua_pushliteral(L, "first");
    lua_pushvalue(L, key);
    lua_rawset(L, -3);
    lua_rawset(L, -3);
    lua_settop(L, value);
    return 2;
  }
  push_visit(L);
  push_part(L, "keys");
  lua_Integer position = lua_istable(L, kKeys) ? position_of(L, kKeys) : -1;
  if (position < 0) {
    lua_settop(L, kVisit);
    push_keys(L, 1);
    lua_pushvalue(L, kKeys);
    set_part(L, "keys");
    position = position_of(L, kKeys);
    if (position < 0) return luaL_error(L, "invalid key to 'next'");
  }
  position = push_entry(L, 1, kKeys, position);
  if (position == 0) {
    end_visit(L);
    lua_pushnil(L);
    return 1;
  }
  lua_pushinteger(L, position);
  set_part(L, "at");
  return 2;
}

int plain_tostring(lua_State* L) {
  luaL_checkany(L, 1);
  push_text(L, 1);
  return 1;
}

// The text of %p: a number for whatever is an object, as Lua's own for all else.
void push_pointer(lua_State* L, int index) {
  const std::uint64_t serial = LuaBudget::serial(L, index);
  if (serial == 0)
    lua_pushliteral(L, "(null)");
  else
    lua_pushfstring(L, "%I", static_cast<LUAI_UACINT>(serial));
}

// Before the library formats them, objects become their text.
int plain_format(lua_State* L) {
  std::size_t size = 0;
  const char* const text = luaL_checklstring(L, 1, &size);
  std::string format(text, size);
  const int given = lua_gettop(L);
  int argument = 1;
  for (std::size_t i = 0; i < format.size(); ++i) {
    if (format[i] != '%') continue;
    if (++i < format.size() && format[i] == '%') continue;
    i = std::min(format.find_first_not_of("-+ #0123456789.", i), format.size());
    if (i == format.size() || ++argument > given) break;
    if (format[i] == 'p')
      push_pointer(L, argument);
    else if (format[i] == 's' && lua_type(L, argument) != LUA_TSTRING)
      push_text(L, argument);
    else
      continue;
    lua_replace(L, argument);
    format[i] = 's';
  }
  lua_pushlstring(L, format.data(), format.size());
  lua_replace(L, 1);
  return call_original(L);
}

// By their names, for they are no objects with a serial number.
void note_builtins(lua_State* L) {
  lua_newtable(L);
  const int names = lua_gettop(L);
  const auto note = [&](int library, const std::string& prefix) {
    for (lua_pushnil(L); lua_next(L, library); lua_pop(L, 1)) {
      if (!lua_iscfunction(L, -1) || lua_type(L, -2) != LUA_TSTRING) continue;
      lua_pushvalue(L, -1);
      lua_pushstring(L, (prefix + lua_tostring(L, -3)).c_str());
      lua_rawset(L, names);
    }
  };
  lua_pushglobaltable(L);
  note(lua_gettop(L), "");
  for (const char* library :
       {LUA_TABLIBNAME, LUA_STRLIBNAME, LUA_MATHLIBNAME, LUA_UTF8LIBNAME, LUA_COLIBNAME}) {
    lua_getfield(L, names + 1, library);
    note(lua_gettop(L), std::string(library) + ".");
    lua_pop(L, 1);
  }
  lua_pop(L, 1);
  lua_setfield(L, LUA_REGISTRYINDEX, kBuiltins);
}

}  // namespace

const char* push_text(lua_State* L, int index, std::size_t* size) {
  index = lua_absindex(L, index);
  const int type = lua_type(L, index);
  const bool object = type == LUA_TTABLE || type == LUA_TFUNCTION || type == LUA_TUSERDATA ||
                      type == LUA_TTHREAD || type == LUA_TLIGHTUSERDATA;
  if (!object) return luaL_tolstring(L, index, size);
  if (luaL_getmetafield(L, index, "__tostring") != LUA_TNIL) {
    lua_pop(L, 1);
    return luaL_tolstring(L, index, size);
  }
  const int name = luaL_getmetafield(L, index, "__name");
  const std::string kind =
      name == LUA_TSTRING ? std::string(text_at(L, -1)) : luaL_typename(L, index);
  if (name != LUA_TNIL) lua_pop(L, 1);
  const std::uint64_t serial = LuaBudget::serial(L, index);
  const std::string text = kind + ": " +
                           (serial > 0              ? std::to_string(serial)
                            : type == LUA_TFUNCTION ? std::string(builtin_name(L, index))
                                                    : std::string("of the host"));
  lua_pushlstring(L, text.data(), text.size());
  return lua_tolstring(L, -1, size);
}

void order_library(lua_State* L) {
  note_builtins(L);
  lua_newtable(L);
  lua_createtable(L, 0, 1);
  lua_pushliteral(L, "k");
  lua_setfield(L, -2, "__mode");
  lua_setmetatable(L, -2);
  lua_setfield(L, LUA_REGISTRYINDEX, kVisits);
  replace_functions(
      L, LUA_GNAME,
      {{"next", ordered_next}, {"pairs", ordered_pairs}, {"tostring", plain_tostring}});
  replace_functions(L, LUA_STRLIBNAME, {{"format", plain_format}});
}

}  // namespace sim
