// The functions of `math` that libraries of C compute differently: here they have the same bits on
// every machine. sqrt, fmod, floor, .. are exact everywhere, and random is Lua's own.
#include "core/lua/library/library.h"
#include "core/math/elementary.h"

namespace sim {
namespace {

template <double (*kFunction)(double)>
int of_number(lua_State* L) {
  lua_pushnumber(L, kFunction(luaL_checknumber(L, 1)));
  return 1;
}

template <double (*kFunction)(double, double)>
int of_two_numbers(lua_State* L) {
  lua_pushnumber(L, kFunction(luaL_checknumber(L, 1), luaL_checknumber(L, 2)));
  return 1;
}

int arc_tangent(lua_State* L) {
  lua_pushnumber(L, elementary::atan2(luaL_checknumber(L, 1), luaL_optnumber(L, 2, 1)));
  return 1;
}

// log(x, base)
int logarithm_in_base(lua_State* L) {
  const double x = luaL_checknumber(L, 1);
  if (lua_isnoneornil(L, 2)) {
    lua_pushnumber(L, elementary::log(x));
    return 1;
  }
  const double base = luaL_checknumber(L, 2);
  lua_pushnumber(L, base == 2    ? elementary::log2(x)
                    : base == 10 ? elementary::log10(x)
                                 : elementary::log(x) / elementary::log(base));
  return 1;
}

}  // namespace

void exact_mathematics(lua_State* L) {
  constexpr luaL_Reg kFunctions[] = {{"sin", of_number<elementary::sin>},
                                     {"cos", of_number<elementary::cos>},
                                     {"tan", of_number<elementary::tan>},
                                     {"asin", of_number<elementary::asin>},
                                     {"acos", of_number<elementary::acos>},
                                     {"atan", arc_tangent},
                                     {"exp", of_number<elementary::exp>},
                                     {"log", logarithm_in_base},
                                     // Names of Lua 5.3, which some builds of 5.4 have.
                                     {"log10", of_number<elementary::log10>},
                                     {"pow", of_two_numbers<elementary::pow>},
                                     {"sinh", of_number<elementary::sinh>},
                                     {"cosh", of_number<elementary::cosh>},
                                     {"tanh", of_number<elementary::tanh>},
                                     {nullptr, nullptr}};
  lua_getglobal(L, LUA_MATHLIBNAME);
  luaL_setfuncs(L, kFunctions, 0);
  lua_pop(L, 1);
}

}  // namespace sim
