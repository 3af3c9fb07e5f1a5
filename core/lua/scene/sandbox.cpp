#include "core/lua/scene/sandbox.h"

#include <algorithm>
#include <cstring>
#include <string_view>
#include <vector>

#include "core/base/text.h"
#include "core/lua/library/order.h"

namespace sim {
namespace {

constexpr const char* kRandom = "sim.random";  // registry: the library's own functions
constexpr const char* kRandomSeed = "sim.randomseed";

// Standard names that a scene does not have; reading one gives nil, as in any Lua without it.
constexpr std::string_view kAbsent[] = {
    "os",         "io",      "debug",    "package",        "load",
    "loadstring", "dofile",  "loadfile", "collectgarbage", "warn",
    "unpack",     "setfenv", "getfenv",  "module",         "jit",
    "bit32",      "arg"};

void seed_random(lua_State* L, std::uint64_t seed) {
  lua_getfield(L, LUA_REGISTRYINDEX, kRandomSeed);
  lua_pushinteger(L, static_cast<lua_Integer>(seed));
  lua_pushinteger(L, 0);
  lua_call(L, 2, 0);
}

// Without arguments Lua would take the time of day; here the seed of the run. Upvalue: that seed.
int randomseed(lua_State* L) {
  const int given = lua_gettop(L);
  if (given == 0) {
    seed_random(L, static_cast<std::uint64_t>(lua_tointeger(L, lua_upvalueindex(1))));
    return 0;
  }
  lua_getfield(L, LUA_REGISTRYINDEX, kRandomSeed);
  lua_insert(L, 1);
  lua_call(L, given, 0);
  return 0;
}

// A misspelt variable would silently be nil, and its parameter the default.
int unknown_global(lua_State* L) {
  if (lua_type(L, 2) != LUA_TSTRING) return 0;
  const std::string name = lua_tostring(L, 2);
  if (std::find(std::begin(kAbsent), std::end(kAbsent), name) != std::end(kAbsent)) return 0;
  const std::vector<std::string> known = names_in(L, 1);
  ErrorText text{"unknown name '" + one_line_text(name) + "'", "", "no such local or global", ""};
  const std::string near = nearest(name, known);
  text.remedy = near.empty() ? "declare it with local" : "did you mean '" + near + "'?";
  lua_Debug frame;
  for (int level = 1; lua_getstack(L, level, &frame) && text.where.empty(); ++level) {
    lua_getinfo(L, "Sl", &frame);
    if (frame.currentline > 0) text.where = lua_place(frame.source, frame.currentline);
  }
  raise(L, ErrorKind::kScene, text);
}

void remove(lua_State* L, const char* library, std::initializer_list<const char*> names) {
  lua_getglobal(L, library);
  for (const char* name : names) {
    lua_pushnil(L);
    lua_setfield(L, -2, name);
  }
  lua_pop(L, 1);
}

}  // namespace

std::vector<std::string> names_in(lua_State* L, int table) {
  constexpr std::size_t kLongest = 64, kMost = 500;
  constexpr std::uint64_t kWork = 100'000;  // of comparing them with a name
  table = lua_absindex(L, table);
  std::vector<std::string> names;
  for (lua_pushnil(L); lua_next(L, table); lua_pop(L, 1)) {
    charge(L, 4);
    if (lua_type(L, -2) == LUA_TSTRING && lua_rawlen(L, -2) <= kLongest && names.size() < kMost)
      names.emplace_back(lua_tostring(L, -2), lua_rawlen(L, -2));
  }
  if (names.size() > 100) charge(L, kWork);
  std::sort(names.begin(), names.end());
  return names;
}

void open_sandbox(lua_State* L, std::uint64_t seed) {
  constexpr luaL_Reg kLibraries[] = {
      {LUA_GNAME, luaopen_base},        {LUA_TABLIBNAME, luaopen_table},
      {LUA_STRLIBNAME, luaopen_string}, {LUA_MATHLIBNAME, luaopen_math},
      {LUA_UTF8LIBNAME, luaopen_utf8},  {LUA_COLIBNAME, luaopen_coroutine}};
  for (const luaL_Reg& library : kLibraries) {
    luaL_requiref(L, library.name, library.func, 1);
    lua_pop(L, 1);
  }
  remove(L, LUA_GNAME, {"load", "dofile", "loadfile", "collectgarbage", "warn"});
  remove(L, LUA_STRLIBNAME, {"dump"});
  bound_basics(L);
  bound_strings(L);
  bound_tables(L);
  bound_coroutines(L);
  exact_mathematics(L);

  // The library's generator, repeatable.
  lua_getglobal(L, LUA_MATHLIBNAME);
  lua_getfield(L, -1, "random");
  lua_setfield(L, LUA_REGISTRYINDEX, kRandom);
  lua_getfield(L, -1, "randomseed");
  lua_setfield(L, LUA_REGISTRYINDEX, kRandomSeed);
  lua_pushinteger(L, static_cast<lua_Integer>(seed));
  lua_pushcclosure(L, randomseed, 1);
  lua_setfield(L, -2, "randomseed");
  lua_pop(L, 1);
  seed_random(L, seed);

  order_library(L);

  // Strict globals.
  lua_pushglobaltable(L);
  lua_newtable(L);
  lua_pushcfunction(L, guarded<unknown_global>);
  lua_setfield(L, -2, "__index");
  lua_pushliteral(L, "scene");
  lua_setfield(L, -2, "__metatable");
  lua_setmetatable(L, -2);
  lua_pop(L, 1);
}

RandomScope::RandomScope(lua_State* L, std::uint64_t seed) {
  lua_getfield(L, LUA_REGISTRYINDEX, kRandom);
  if (lua_getupvalue(L, -1, 1)) {
    state_ = lua_touserdata(L, -1);
    size_ = state_ ? std::min<std::size_t>(lua_rawlen(L, -1), sizeof saved_) : 0;
    if (size_) std::memcpy(saved_, state_, size_);
    lua_pop(L, 1);
  }
  lua_pop(L, 1);
  seed_random(L, seed);
}

RandomScope::~RandomScope() {
  if (size_) std::memcpy(state_, saved_, size_);
}

}  // namespace sim
