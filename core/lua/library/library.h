// Functions of Lua's standard library that could run for ever inside, or outlive an error: here
// they do the same and charge what they do to the budget. Functions whose bits depend on the
// machine have their own bits here.
#pragma once

#include "core/lua/lua_state.h"

namespace sim {

// Each puts its functions in the place of those that luaL_requiref opened.
void bound_basics(lua_State* L);      // xpcall, setmetatable (which refuses __gc)
void bound_strings(lua_State* L);     // find, match, gmatch, gsub, rep, pack, byte; utf8
void bound_tables(lua_State* L);      // insert, remove, move, concat, unpack, sort
void bound_coroutines(lua_State* L);  // create, wrap, resume, close

void exact_mathematics(lua_State* L);  // sin, cos, tan, asin, acos, atan, exp, log; log10, pow, ..

// Counts work in units of an instruction; raises an error of Lua at the end of the budget.
inline void charge(lua_State* L, std::uint64_t units) { LuaBudget::of(L).charge(L, units); }

// Puts functions into the global table `library`. Upvalue 1 of each is what was there before.
void replace_functions(lua_State* L, const char* library,
                       std::initializer_list<luaL_Reg> functions);

// Goes on as the function that was replaced, with the arguments on the stack.
inline int call_original(lua_State* L) { return lua_tocfunction(L, lua_upvalueindex(1))(L); }

}  // namespace sim
