// xpcall and setmetatable, and the functions of coroutines.
#include "core/lua/library/library.h"

namespace sim {

void replace_functions(lua_State* L, const char* library,
                       std::initializer_list<luaL_Reg> functions) {
  lua_getglobal(L, library);
  for (const luaL_Reg& function : functions) {
    lua_getfield(L, -1, function.name);
    lua_pushcclosure(L, function.func, 1);
    lua_setfield(L, -2, function.name);
  }
  lua_pop(L, 1);
}

namespace {

constexpr std::uint64_t kThreadWork = 1000;  // as if a thread had used up its turn

// No hook is called in a message handler of an error that a hook has raised. Upvalue: the handler.
int handle_unless_ended(lua_State* L) {
  if (LuaBudget::of(L).ended() != LuaBudget::End::kNone) return 1;
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  lua_call(L, lua_gettop(L) - 1, 1);
  return 1;
}

// Below what the call gives: the function and the handler.
int end_protected(lua_State* L, int status, lua_KContext /*context*/) {
  LuaBudget::of(L).check(L);
  const bool good = status == LUA_OK || status == LUA_YIELD;
  lua_pushboolean(L, good);
  if (good)
    lua_replace(L, 2);
  else
    lua_insert(L, -2);
  return good ? lua_gettop(L) - 1 : 2;
}

int bounded_xpcall(lua_State* L) {
  const int given = lua_gettop(L) - 2;
  luaL_checktype(L, 2, LUA_TFUNCTION);
  lua_pushvalue(L, 2);
  lua_pushcclosure(L, handle_unless_ended, 1);
  lua_replace(L, 2);
  lua_pushvalue(L, 1);
  lua_rotate(L, 3, 1);  // function, handler, function, arguments
  return end_protected(L, lua_pcallk(L, given, LUA_MULTRET, 2, 0, end_protected), 0);
}

// Finalizers run when the collector likes: results would not repeat, and nothing could stop them.
int bounded_setmetatable(lua_State* L) {
  if (lua_istable(L, 2)) {
    lua_pushliteral(L, "__gc");
    if (lua_rawget(L, 2) != LUA_TNIL)
      return luaL_error(L, "a scene has no finalizers (__gc): they run at no fixed time");
    lua_pop(L, 1);
  }
  return call_original(L);
}

int bounded_create(lua_State* L) {
  charge(L, kThreadWork);
  return call_original(L);
}

lua_State* thread_argument(lua_State* L) {
  lua_State* const thread = lua_tothread(L, 1);
  luaL_argexpected(L, thread, 1, "thread");
  return thread;
}

int bounded_resume(lua_State* L) {
  charge(L, kThreadWork);
  const LuaBudget::Thread inside(thread_argument(L));
  const int results = call_original(L);
  LuaBudget::of(L).check(L);
  return results;
}

// A coroutine stopped by its budget is not closed, for its close handlers would run without hooks.
int bounded_close(lua_State* L) {
  lua_State* const thread = thread_argument(L);
  if (LuaBudget::spoiled(thread)) return luaL_error(L, "the coroutine was stopped");
  const LuaBudget::Thread inside(thread);
  const int results = call_original(L);
  LuaBudget::of(L).check(L);
  return results;
}

// Upvalue: the thread. An error in it goes on here, with the place of the call before it.
int call_wrapped(lua_State* L) {
  charge(L, kThreadWork);
  LuaBudget& budget = LuaBudget::of(L);
  lua_State* const thread = lua_tothread(L, lua_upvalueindex(1));
  const int given = lua_gettop(L);
  int status = LUA_ERRRUN, count = 0;
  if (!lua_checkstack(thread, given)) return luaL_error(L, "too many arguments to resume");
  lua_xmove(L, thread, given);
  {
    const LuaBudget::Thread inside(thread);
    status = lua_resume(thread, L, given, &count);
    budget.check(L);
    if (status != LUA_OK && status != LUA_YIELD) {
      if (lua_status(thread) != LUA_OK && lua_status(thread) != LUA_YIELD)
        status = lua_resetthread(thread);  // runs its close handlers
      budget.check(L);
      count = 1;
    }
  }
  if (!lua_checkstack(L, count + 3)) {
    lua_pop(thread, count);
    return luaL_error(L, "too many results to resume");
  }
  lua_xmove(thread, L, count);
  if (status == LUA_OK || status == LUA_YIELD) return count;
  if (status != LUA_ERRMEM && lua_type(L, -1) == LUA_TSTRING) {
    luaL_where(L, 1);
    lua_insert(L, -2);
    lua_concat(L, 2);
  }
  return lua_error(L);
}

int bounded_wrap(lua_State* L) {
  charge(L, kThreadWork);
  luaL_checktype(L, 1, LUA_TFUNCTION);
  lua_State* const thread = lua_newthread(L);
  lua_pushvalue(L, 1);
  lua_xmove(L, thread, 1);
  lua_pushcclosure(L, call_wrapped, 1);
  return 1;
}

}  // namespace

void bound_basics(lua_State* L) {
  replace_functions(L, LUA_GNAME,
                    {{"xpcall", bounded_xpcall}, {"setmetatable", bounded_setmetatable}});
}

void bound_coroutines(lua_State* L) {
  replace_functions(L, LUA_COLIBNAME,
                    {{"create", bounded_create},
                     {"wrap", bounded_wrap},
                     {"resume", bounded_resume},
                     {"close", bounded_close}});
}

}  // namespace sim
