// The functions of `table` that visit many entries.
#include <algorithm>
#include <climits>
#include <limits>

#include "core/lua/library/library.h"

namespace sim {
namespace {

constexpr int kReads = 1, kWrites = 2, kCounts = 4;  // the use that a function makes of a table

// Anything else than a table needs metamethods for that.
void check_table(lua_State* L, int argument, int needs) {
  if (lua_type(L, argument) == LUA_TTABLE) return;
  bool good = lua_getmetatable(L, argument) != 0;
  const int top = lua_gettop(L);
  for (const auto& [need, name] :
       {std::pair{kReads, "__index"}, {kWrites, "__newindex"}, {kCounts, "__len"}})
    if (good && (needs & need)) {
      lua_pushstring(L, name);
      good = lua_rawget(L, top) != LUA_TNIL;
    }
  if (!good) luaL_checktype(L, argument, LUA_TTABLE);
  lua_settop(L, top - 1);
}

lua_Integer length_of(lua_State* L, int argument, int needs) {
  check_table(L, argument, needs | kCounts);
  return luaL_len(L, argument);
}

// to[j] := from[i]; with or without metamethods.
void copy_entry(lua_State* L, int from, lua_Integer i, int to, lua_Integer j) {
  charge(L, 2);
  lua_geti(L, from, i);
  lua_seti(L, to, j);
}

int bounded_insert(lua_State* L) {
  const lua_Integer length = length_of(L, 1, kReads | kWrites);
  const auto after = static_cast<lua_Integer>(static_cast<lua_Unsigned>(length) + 1U);
  lua_Integer place = after;
  if (lua_gettop(L) == 3) {
    place = luaL_checkinteger(L, 2);
    luaL_argcheck(L, static_cast<lua_Unsigned>(place) - 1U < static_cast<lua_Unsigned>(after), 2,
                  "position out of bounds");
    for (lua_Integer i = after; i > place; --i) copy_entry(L, 1, i - 1, 1, i);
  } else if (lua_gettop(L) != 2) {
    return luaL_error(L, "wrong number of arguments to 'insert'");
  }
  charge(L, 2);
  lua_seti(L, 1, place);
  return 0;
}

int bounded_remove(lua_State* L) {
  const lua_Integer length = length_of(L, 1, kReads | kWrites);
  lua_Integer place = luaL_optinteger(L, 2, length);
  if (lua_gettop(L) > 1 && place != length)
    luaL_argcheck(L, static_cast<lua_Unsigned>(place) - 1U <= static_cast<lua_Unsigned>(length), 1,
                  "position out of bounds");
  charge(L, 2);
  lua_geti(L, 1, place);
  for (; place < length; ++place) copy_entry(L, 1, place + 1, 1, place);
  lua_pushnil(L);
  lua_seti(L, 1, place);
  return 1;
}

// Backwards where the places overlap so.
int bounded_move(lua_State* L) {
  const lua_Integer first = luaL_checkinteger(L, 2), last = luaL_checkinteger(L, 3);
  const lua_Integer target = luaL_checkinteger(L, 4);
  const int to = lua_isnoneornil(L, 5) ? 1 : 5;
  check_table(L, 1, kReads);
  check_table(L, to, kWrites);
  constexpr lua_Integer kMost = std::numeric_limits<lua_Integer>::max();
  if (last >= first) {
    luaL_argcheck(L, first > 0 || last < kMost + first, 3, "too many elements to move");
    const lua_Integer count = last - first + 1;
    luaL_argcheck(L, target <= kMost - count + 1, 4, "destination wrap around");
    const bool forwards =
        target > last || target <= first || (to != 1 && !lua_compare(L, 1, to, LUA_OPEQ));
    for (lua_Integer k = 0; k < count; ++k) {
      const lua_Integer i = forwards ? k : count - 1 - k;
      copy_entry(L, 1, first + i, to, target + i);
    }
  }
  lua_pushvalue(L, to);
  return 1;
}

int bounded_concat(lua_State* L) {
  lua_Integer last = length_of(L, 1, kReads);
  std::size_t size = 0;
  const char* const between = luaL_optlstring(L, 2, "", &size);
  lua_Integer i = luaL_optinteger(L, 3, 1);
  last = luaL_optinteger(L, 4, last);
  luaL_Buffer text;
  luaL_buffinit(L, &text);
  for (; i <= last; ++i) {
    charge(L, 4);
    lua_geti(L, 1, i);
    if (!lua_isstring(L, -1))
      return luaL_error(L, "invalid value (%s) at index %I in table for 'concat'",
                        luaL_typename(L, -1), static_cast<LUAI_UACINT>(i));
    luaL_addvalue(&text);
    if (i == last) break;
    luaL_addlstring(&text, between, size);
  }
  luaL_pushresult(&text);
  return 1;
}

int bounded_unpack(lua_State* L) {
  const lua_Integer first = luaL_optinteger(L, 2, 1);
  const lua_Integer last = luaL_opt(L, luaL_checkinteger, 3, luaL_len(L, 1));
  if (first > last) return 0;
  const lua_Unsigned count = static_cast<lua_Unsigned>(last) - static_cast<lua_Unsigned>(first);
  if (count >= static_cast<lua_Unsigned>(INT_MAX) ||
      !lua_checkstack(L, static_cast<int>(count) + 1))
    return luaL_error(L, "too many results to unpack");
  charge(L, count / 2 + 1);
  for (lua_Unsigned k = 0; k <= count; ++k)
    lua_geti(L, 1, static_cast<lua_Integer>(static_cast<lua_Unsigned>(first) + k));
  return static_cast<int>(count) + 1;
}

// Quicksort with the median of three, as the library's own: it compares and exchanges the same
// entries, so that equal ones end where Lua puts them. Where that one takes the time of day to
// choose better middles of a list that splits badly, this takes a number. The order is at 2, nil
// for <.
class Sorter {
 public:
  explicit Sorter(lua_State* L) : L_(L) {}

  void sort(lua_Integer low, lua_Integer high, std::uint32_t seed) {
    constexpr lua_Integer kLarge = 100, kBad = 128;
    while (low < high) {
      order(low, high);
      if (high - low == 1) return;
      const bool plain = high - low < kLarge || seed == 0;
      const lua_Integer middle = plain ? low + (high - low) / 2 : choose(low, high, seed);
      if (!order(low, middle)) order(middle, high);
      if (high - low == 2) return;
      lua_geti(L_, 1, middle);
      lua_pushvalue(L_, -1);
      lua_geti(L_, 1, high - 1);
      put(middle, high - 1);
      const lua_Integer parted = part(low, high);
      lua_Integer smaller = 0;
      if (parted - low < high - parted) {
        sort(low, parted - 1, seed);
        smaller = parted - low;
        low = parted + 1;
      } else {
        sort(parted + 1, high, seed);
        smaller = high - parted;
        high = parted - 1;
      }
      if ((high - low) / kBad > smaller) seed = 0x9e3779b9U;
    }
  }

 private:
  static lua_Integer choose(lua_Integer low, lua_Integer high, std::uint32_t seed) {
    const lua_Integer quarter = (high - low) / 4;
    return static_cast<lua_Integer>(seed) % (2 * quarter) + low + quarter;
  }

  // Is the value at a of the stack before the one at b?
  bool before(int a, int b) {
    charge(L_, 4);
    if (lua_isnil(L_, 2)) return lua_compare(L_, a, b, LUA_OPLT);
    a = lua_absindex(L_, a);
    b = lua_absindex(L_, b);
    lua_pushvalue(L_, 2);
    lua_pushvalue(L_, a);
    lua_pushvalue(L_, b);
    lua_call(L_, 2, 1);
    const bool result = lua_toboolean(L_, -1);
    lua_pop(L_, 1);
    return result;
  }

  // Pops the two values on top: the upper one goes to i, the lower one to j.
  void put(lua_Integer i, lua_Integer j) {
    lua_seti(L_, 1, i);
    lua_seti(L_, 1, j);
  }

  // Exchanges the entries if they are in the wrong order.
  bool order(lua_Integer i, lua_Integer j) {
    lua_geti(L_, 1, i);
    lua_geti(L_, 1, j);
    const bool wrong = before(-1, -2);
    if (wrong)
      put(i, j);
    else
      lua_pop(L_, 2);
    return wrong;
  }

  // The middle is on top of the stack, which is popped, and at high - 1.
  lua_Integer part(lua_Integer low, lua_Integer high) {
    lua_Integer i = low, j = high - 1;
    for (;;) {
      while (lua_geti(L_, 1, ++i), before(-1, -2)) {
        if (i == high - 1) luaL_error(L_, "invalid order function for sorting");
        lua_pop(L_, 1);
      }
      while (lua_geti(L_, 1, --j), before(-3, -1)) {
        if (j < i) luaL_error(L_, "invalid order function for sorting");
        lua_pop(L_, 1);
      }
      if (j < i) {
        lua_pop(L_, 1);
        lua_geti(L_, 1, high - 1);
        put(i, high - 1);
        lua_pop(L_, 1);
        return i;
      }
      put(i, j);
    }
  }

  lua_State* L_;
};

int bounded_sort(lua_State* L) {
  const lua_Integer length = length_of(L, 1, kReads | kWrites);
  if (length < 2) return 0;
  luaL_argcheck(L, length < INT_MAX, 1, "array too big");
  if (!lua_isnoneornil(L, 2)) luaL_checktype(L, 2, LUA_TFUNCTION);
  lua_settop(L, 2);
  Sorter(L).sort(1, length, 0);
  return 0;
}

}  // namespace

void bound_tables(lua_State* L) {
  replace_functions(L, LUA_TABLIBNAME,
                    {{"insert", bounded_insert},
                     {"remove", bounded_remove},
                     {"move", bounded_move},
                     {"concat", bounded_concat},
                     {"unpack", bounded_unpack},
                     {"sort", bounded_sort}});
}

}  // namespace sim
