#include "core/lua/scene/observer.h"

#include <algorithm>
#include <string_view>

#include "core/base/text.h"
#include "core/lua/lua_read.h"
#include "core/scene/simulation.h"

namespace sim {
namespace {

constexpr const char* kSeenType = "sim.seen";

// The state behind `s` in Lua while its observer runs; empty before and after.
struct Seen {
  const Simulation* system = nullptr;
};

const Simulation& seen(lua_State* L) {
  const auto* handle = static_cast<const Seen*>(luaL_testudata(L, 1, kSeenType));
  if (!handle)
    scene_error(calling_place(L), "bad call in an observer", "it was not called on its argument",
                "write it with a colon, as in s:position(0)");
  if (!handle->system)
    scene_error(calling_place(L), "bad call in an observer",
                "the state is there only while its function runs", "do not keep it");
  return *handle->system;
}

// The index at 2, below `count`.
int index_of(lua_State* L, const char* what, int count) {
  if (!lua_isinteger(L, 2) || lua_tointeger(L, 2) < 0 || lua_tointeger(L, 2) >= count)
    scene_error(calling_place(L), std::string("bad ") + what + " in an observer",
                count > 0 ? "expected a whole number from 0 to " + std::to_string(count - 1) +
                                ", got " + show(L, 2)
                          : "this scene has none");
  return static_cast<int>(lua_tointeger(L, 2));
}

void require_second_order(lua_State* L, const Simulation& system, const char* what) {
  if (!system.second_order())
    scene_error(calling_place(L), std::string("no ") + what + " in an observer",
                std::string("a first-order scene has no ") + what);
}

int push_vector(lua_State* L, const Vec3& value) {
  lua_createtable(L, 3, 0);
  for (int axis = 0; axis < 3; ++axis) {
    lua_pushnumber(L, value[axis]);
    lua_rawseti(L, -2, axis + 1);
  }
  return 1;
}

int seen_position(lua_State* L) {
  const Simulation& system = seen(L);
  return push_vector(L, system.position(index_of(L, "particle", system.particles())));
}

int seen_velocity(lua_State* L) {
  const Simulation& system = seen(L);
  require_second_order(L, system, "velocity");
  return push_vector(L, system.velocity(index_of(L, "particle", system.particles())));
}

int seen_component(lua_State* L) {
  const Simulation& system = seen(L);
  const int count = system.flat() ? system.components() : 0;
  lua_pushnumber(L, system.component(index_of(L, "component", count)));
  return 1;
}

// { position, velocity, rotation, angular_velocity } of a rigid body; the rotation is w, x, y, z of
// length 1. The old names turn and spin are there for one release.
int seen_body(lua_State* L) {
  const Simulation& system = seen(L);
  const int count = system.second_order() ? system.bodies() : 0;
  const RigidState state = system.body_state(index_of(L, "body", count));
  lua_createtable(L, 0, 6);
  push_vector(L, state.center);
  lua_setfield(L, -2, "position");
  push_vector(L, state.velocity);
  lua_setfield(L, -2, "velocity");
  push_vector(L, state.angular_velocity);
  lua_pushvalue(L, -1);
  lua_setfield(L, -3, "angular_velocity");
  lua_setfield(L, -2, "spin");
  lua_createtable(L, 4, 0);
  lua_Integer at = 0;
  for (const double each : state.quaternion()) {
    lua_pushnumber(L, each);
    lua_rawseti(L, -2, ++at);
  }
  lua_pushvalue(L, -1);
  lua_setfield(L, -3, "rotation");
  lua_setfield(L, -2, "turn");
  return 1;
}

// A force may ask Lua for its potential, which a coroutine that waits cannot be entered for.
int seen_energy(lua_State* L) {
  const Simulation& system = seen(L);
  require_second_order(L, system, "energy");
  const bool main = lua_pushthread(L) == 1;
  if (!main)
    scene_error(calling_place(L), "bad call in an observer", "s:energy() in a coroutine",
                "call it outside");
  const Energy energy = system.energy();
  for (const double value : {energy.total(), energy.kinetic, energy.potential})
    lua_pushnumber(L, value);
  return 3;
}

int seen_time(lua_State* L) {
  lua_pushnumber(L, seen(L).t());
  return 1;
}

constexpr luaL_Reg kMethods[] = {{"position", guarded<seen_position>},
                                 {"velocity", guarded<seen_velocity>},
                                 {"body", guarded<seen_body>},
                                 {"energy", guarded<seen_energy>},
                                 {"t", guarded<seen_time>},
                                 {"component", guarded<seen_component>}};

int find_method(lua_State* L) {
  const std::string name = lua_type(L, 2) == LUA_TSTRING ? lua_tostring(L, 2) : show(L, 2);
  std::vector<std::string> known;
  for (const luaL_Reg& method : kMethods) {
    known.emplace_back(method.name);
    if (name != method.name) continue;
    lua_pushcfunction(L, method.func);
    return 1;
  }
  scene_error(calling_place(L), "unknown name '" + one_line_text(name) + "' in an observer",
              "a state has other methods", suggestion(name, known));
}

void push_seen(lua_State* L) {
  *static_cast<Seen*>(lua_newuserdatauv(L, sizeof(Seen), 0)) = {};
  if (luaL_newmetatable(L, kSeenType)) {
    lua_pushcfunction(L, guarded<find_method>);
    lua_setfield(L, -2, "__index");
    lua_pushstring(L, kSeenType);
    lua_setfield(L, -2, "__metatable");
  }
  lua_setmetatable(L, -2);
}

class LuaObserver {
 public:
  LuaObserver(std::shared_ptr<SceneSession> session, lua_State* L, int index, std::string name)
      : session_(std::move(session)), name_(std::move(name)) {
    lua_Debug info;
    lua_pushvalue(L, index);
    lua_getinfo(L, ">S", &info);
    place_ = lua_place(info.source, info.linedefined);
    lua_pushvalue(L, index);
    function_ = luaL_ref(L, LUA_REGISTRYINDEX);
    push_seen(L);
    seen_ = static_cast<Seen*>(lua_touserdata(L, -1));
    handle_ = luaL_ref(L, LUA_REGISTRYINDEX);
  }
  ~LuaObserver() {
    session_->lua().release(function_);
    session_->lua().release(handle_);
  }
  LuaObserver(const LuaObserver&) = delete;
  LuaObserver& operator=(const LuaObserver&) = delete;

  double operator()(const Simulation& system) const {
    struct Lent {
      Seen* seen;
      ~Lent() { seen->system = nullptr; }
    } const lent{seen_};
    seen_->system = &system;
    double value = 0;
    try {
      session_->lua().protect(place_, [&](lua_State* L) {
        lua_rawgeti(L, LUA_REGISTRYINDEX, function_);
        lua_rawgeti(L, LUA_REGISTRYINDEX, handle_);
        lua_call(L, 1, 1);
        if (lua_type(L, -1) != LUA_TNUMBER)
          scene_error(place_, "bad result of observer '" + name_ + "'",
                      "expected a number, got " + show(L, -1));
        value = lua_tonumber(L, -1);
      });
    } catch (const Error& error) {
      ErrorText text = error.text();
      if (text.why == kInterrupted) throw;
      if (text.what == "Lua error") text.what = "error in observer '" + name_ + "'";
      if (text.what == "Lua takes too long") text.what += " in observer '" + name_ + "'";
      throw Error(error.kind(), text);
    }
    return value;
  }

 private:
  std::shared_ptr<SceneSession> session_;
  std::string name_;
  SourceLocation place_;
  int function_ = LUA_NOREF, handle_ = LUA_NOREF;
  Seen* seen_ = nullptr;  // of the handle
};

}  // namespace

std::vector<ObserverSpec> read_observers(const std::shared_ptr<SceneSession>& session, lua_State* L,
                                         int index, const SourceLocation& place) {
  if (!lua_istable(L, index))
    scene_error(place, "bad observe",
                "expected { NAME = function(s) ... end }, got " + show(L, index));
  std::vector<ObserverSpec> observers;
  for (lua_pushnil(L); lua_next(L, index); lua_pop(L, 1)) {
    if (lua_type(L, -2) != LUA_TSTRING)
      scene_error(place, "bad observe", "every quantity has a name, found the key " + show(L, -2),
                  "write observe = { sag = function(s) ... end }");
    const std::string name(lua_tostring(L, -2), lua_rawlen(L, -2));
    const bool word = !name.empty() && name.size() <= 64 && std::ranges::all_of(name, [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    });
    if (!word || name == "system" || name == "step" || name == "t")
      scene_error(
          place, "bad name '" + one_line_text(name) + "' in observe",
          word ? "tables have a column of that name already" : "expected letters, digits and _");
    if (!lua_isfunction(L, -1) || lua_iscfunction(L, -1))
      scene_error(place, "bad observer '" + name + "'",
                  "expected a function(s) written in the scene, got " + show(L, -1));
    auto observer = std::make_shared<LuaObserver>(session, L, lua_gettop(L), name);
    observers.push_back(
        {name, [observer](const Simulation& system) { return (*observer)(system); }});
  }
  std::ranges::sort(observers, {}, &ObserverSpec::name);
  return observers;
}

}  // namespace sim
