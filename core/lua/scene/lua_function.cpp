#include "core/lua/scene/lua_function.h"

#include <atomic>
#include <cmath>
#include <span>

#include "core/base/text.h"
#include "core/geometry/rigid_motion.h"
#include "core/lua/lua_read.h"
#include "core/particles/constraint.h"

namespace sim {
namespace {

// A function held in the registry of its state.
class LuaFunction {
 public:
  LuaFunction(std::shared_ptr<SceneSession> session, lua_State* L, int index, int dimension)
      : session_(std::move(session)), dimension_(dimension) {
    lua_Debug info;
    lua_pushvalue(L, index);
    lua_getinfo(L, ">Su", &info);
    parameters_ = info.isvararg ? 2 : info.nparams;
    place_ = lua_place(info.source, info.linedefined);
    lua_pushvalue(L, index);
    reference_ = luaL_ref(L, LUA_REGISTRYINDEX);
  }
  ~LuaFunction() { session_->lua().release(reference_); }
  LuaFunction(const LuaFunction&) = delete;
  LuaFunction& operator=(const LuaFunction&) = delete;

  // out := f(t, x), or f(t) without x.
  void call(double t, const std::span<const double>* x, std::span<double> out) const {
    session_->lua().protect(place_, [&](lua_State* L) {
      lua_rawgeti(L, LUA_REGISTRYINDEX, reference_);
      lua_pushnumber(L, t);
      if (x) push_state(L, *x);
      lua_call(L, x ? 2 : 1, 1);
      read_state(L, out);
    });
  }

  // f(t, i, x, v) of each id.
  void call(const ParticleView& view, std::span<const int> ids, std::span<double> out,
            const std::string& what) const;

  // f(t) as a place and, where it returns two values, a velocity. False for one value.
  bool call(double t, Vec3& x, Vec3& v, const std::string& what) const;

  // f(s, t)
  Vec3 call(double s, double t, const std::string& what) const;

  const SourceLocation& place() const { return place_; }
  bool takes_two() const { return parameters_ >= 2; }

 private:
  void call_one(lua_State* L, const ParticleView& view, int i, std::span<double> out,
                const std::string& what) const;
  void push_state(lua_State* L, std::span<const double> x) const;
  void read_state(lua_State* L, std::span<double> out) const;
  double component(lua_State* L) const;  // pops it
  [[noreturn]] void wrong(const std::string& got, std::size_t size) const;

  std::shared_ptr<SceneSession> session_;
  int dimension_, reference_ = LUA_NOREF, parameters_ = 0;
  SourceLocation place_;
};

void LuaFunction::push_state(lua_State* L, std::span<const double> x) const {
  const int size = static_cast<int>(x.size());
  lua_createtable(L, size / dimension_, 0);
  for (int i = 0; i < size / dimension_; ++i) {
    if (dimension_ == 1) {
      lua_pushnumber(L, x[static_cast<std::size_t>(i)]);
    } else {
      lua_createtable(L, dimension_, 0);
      for (int axis = 0; axis < dimension_; ++axis) {
        lua_pushnumber(L, x[static_cast<std::size_t>(i * dimension_ + axis)]);
        lua_rawseti(L, -2, axis + 1);
      }
    }
    lua_rawseti(L, -2, i + 1);
  }
}

void LuaFunction::call(const ParticleView& view, std::span<const int> ids, std::span<double> out,
                       const std::string& what) const {
  if (ids.empty()) return;
  const std::size_t wanted = out.size() / ids.size();
  std::size_t now = 0;
  try {
    session_->lua().protect(place_, [&](lua_State* L) {
      lua_rawgeti(L, LUA_REGISTRYINDEX, reference_);
      lua_createtable(L, 3, 0);
      if (view.vx)
        lua_createtable(L, 3, 0);
      else
        lua_pushnil(L);
      for (; now < ids.size(); ++now)
        call_one(L, view, ids[now], out.subspan(now * wanted, wanted), what);
    });
  } catch (const Error& error) {
    if (error.text().why == kInterrupted) throw;
    ErrorText text = error.text();
    text.why += ", at particle " + std::to_string(ids[now]);
    throw Error(error.kind(), text);
  }
}

// On a stack of the function and the tables of x and v, which stay.
void LuaFunction::call_one(lua_State* L, const ParticleView& view, int i, std::span<double> out,
                           const std::string& what) const {
  constexpr int kFunction = 1, kPosition = 2, kVelocity = 3;
  const auto fill = [&](int table, const Vec3& values) {
    for (int axis = 0; axis < 3; ++axis) {
      lua_pushnumber(L, values[axis]);
      lua_rawseti(L, table, axis + 1);
    }
  };
  lua_pushvalue(L, kFunction);
  lua_pushnumber(L, view.t);
  lua_pushinteger(L, i);
  lua_pushvalue(L, kPosition);
  lua_pushvalue(L, kVelocity);
  fill(kPosition, view.position(i));
  if (view.vx) fill(kVelocity, view.velocity(i));
  lua_call(L, 4, LUA_MULTRET);

  const int given = lua_gettop(L) - kVelocity, wanted = static_cast<int>(out.size());
  bool good = given == wanted;
  for (int j = 1; good && j <= wanted; ++j) good = lua_type(L, kVelocity + j) == LUA_TNUMBER;
  if (!good) {
    std::string got = given == 0 ? "nothing" : "";
    for (int j = 1; j <= given && j <= 5; ++j)
      got += (j > 1 ? ", " : "") + (j < 5 ? show(L, kVelocity + j) : "...");
    scene_error(place_, "bad result of " + what,
                "expected " + std::to_string(wanted) + (wanted == 1 ? " number" : " numbers") +
                    ", got " + got);
  }
  for (int j = 0; j < wanted; ++j)
    out[static_cast<std::size_t>(j)] = lua_tonumber(L, kVelocity + 1 + j);
  lua_settop(L, kVelocity);
}

void LuaFunction::wrong(const std::string& got, std::size_t size) const {
  const std::string flat = "a list of " + std::to_string(size) + " numbers";
  const std::string points = std::to_string(size / 3) + " vectors {x, y, z}";
  scene_error(place_, "bad result of a function",
              "expected " + (dimension_ == 3 ? "a list of " + points : flat) + ", got " + got,
              "return it in the form of the state");
}

double LuaFunction::component(lua_State* L) const {
  if (lua_type(L, -1) != LUA_TNUMBER)
    scene_error(place_, "bad result of a function", "expected numbers, got " + show(L, -1));
  const double value = lua_tonumber(L, -1);
  lua_pop(L, 1);
  return value;
}

// Flat lists are welcome for points too.
void LuaFunction::read_state(lua_State* L, std::span<double> out) const {
  if (!lua_istable(L, -1)) wrong(show(L, -1), out.size());
  const std::size_t length = lua_rawlen(L, -1);
  lua_rawgeti(L, -1, 1);
  const bool nested = lua_istable(L, -1);
  lua_pop(L, 1);
  const std::size_t per_entry = nested ? 3 : 1;
  if ((nested && dimension_ != 3) || length * per_entry != out.size())
    wrong("a list of " + std::to_string(length) + (nested ? " tables" : " values"), out.size());

  for (std::size_t i = 0; i < length; ++i) {
    lua_rawgeti(L, -1, static_cast<lua_Integer>(i) + 1);
    if (!nested) {
      out[i] = component(L);
      continue;
    }
    if (!lua_istable(L, -1) || lua_rawlen(L, -1) != 3)
      wrong("an entry that is not a vector of 3 numbers", out.size());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      lua_rawgeti(L, -1, static_cast<lua_Integer>(axis) + 1);
      out[3 * i + axis] = component(L);
    }
    lua_pop(L, 1);
  }
}

// Without a word for an error, which would take longer than the rest.
bool is_vector(lua_State* L, int index, Vec3& v) {
  if (!lua_istable(L, index) || lua_rawlen(L, index) != 3) return false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool number = lua_rawgeti(L, index, static_cast<lua_Integer>(axis) + 1) == LUA_TNUMBER;
    v[axis] = lua_tonumber(L, -1);
    lua_pop(L, 1);
    if (!number) return false;
  }
  return v.allFinite();
}

}  // namespace

bool LuaFunction::call(double t, Vec3& x, Vec3& v, const std::string& what) const {
  bool both = false;
  session_->lua().protect(place_, [&](lua_State* L) {
    lua_rawgeti(L, LUA_REGISTRYINDEX, reference_);
    lua_pushnumber(L, t);
    lua_call(L, 1, 2);
    both = !lua_isnil(L, 2);
    if (is_vector(L, 1, x) && (!both || is_vector(L, 2, v))) return;
    const std::string at = " of " + what + " at t = " + brief(t) + " s";
    x = read_vector(L, 1, place_, "result" + at);
    if (both) v = read_vector(L, 2, place_, "velocity" + at);
  });
  return both;
}

Vec3 LuaFunction::call(double s, double t, const std::string& what) const {
  Vec3 x;
  session_->lua().protect(place_, [&](lua_State* L) {
    lua_rawgeti(L, LUA_REGISTRYINDEX, reference_);
    lua_pushnumber(L, s);
    lua_pushnumber(L, t);
    lua_call(L, 2, 1);
    if (!is_vector(L, 1, x))
      x = read_vector(L, 1, place_, "result of " + what + " at s = " + brief(s));
  });
  return x;
}

namespace {

class LuaCurve final : public Curve {
 public:
  LuaCurve(std::shared_ptr<LuaFunction> function, std::string what)
      : function_(std::move(function)), what_(std::move(what)) {}

  Vec3 at(double s, double t) const override { return function_->call(s, t, what_); }
  bool moves() const override { return function_->takes_two(); }

 private:
  std::shared_ptr<LuaFunction> function_;
  std::string what_;
};

class LuaMotion final : public RigidMotion {
 public:
  LuaMotion(std::shared_ptr<LuaFunction> function, std::string what)
      : function_(std::move(function)), what_(std::move(what)) {}

  Pose at(double t, const Vec3& /*center*/) const override {
    Pose pose;
    if (function_->call(t, pose.center, pose.velocity, what_)) return pose;
    differences_ = true;
    pose.velocity =
        (8 * (place(t + kStep) - place(t - kStep)) - place(t + 2 * kStep) + place(t - 2 * kStep)) /
        (12 * kStep);
    return pose;
  }
  Vec3 center_at(double t, const Vec3& /*center*/) const override { return place(t); }
  bool sampled() const override { return true; }
  const char* note() const override {
    return differences_ ? "the velocity of its motion is had by differences; return it second" : "";
  }

 private:
  static constexpr double kStep = 0x1p-12;  // s, of Richardson's central differences

  Vec3 place(double t) const {
    Vec3 x, v;
    function_->call(t, x, v, what_);
    return x;
  }

  std::shared_ptr<LuaFunction> function_;
  std::string what_;
  mutable std::atomic<bool> differences_{false};
};

}  // namespace

std::shared_ptr<const RigidMotion> make_motion_function(
    const std::shared_ptr<SceneSession>& session, lua_State* L, int index,
    const std::string& what) {
  session->set_called();
  return std::make_shared<LuaMotion>(std::make_shared<LuaFunction>(session, L, index, 1), what);
}

std::shared_ptr<const Curve> make_curve_function(const std::shared_ptr<SceneSession>& session,
                                                 lua_State* L, int index, const std::string& what) {
  session->set_called();
  return std::make_shared<LuaCurve>(std::make_shared<LuaFunction>(session, L, index, 1), what);
}

OdeFunction make_ode_function(const std::shared_ptr<SceneSession>& session, lua_State* L, int index,
                              int dimension) {
  session->set_called();
  auto function = std::make_shared<LuaFunction>(session, L, index, dimension);
  return [function](double t, std::span<const double> x, std::span<double> dxdt) {
    function->call(t, &x, dxdt);
  };
}

ParticleFunction make_particle_function(const std::shared_ptr<SceneSession>& session, lua_State* L,
                                        int index, const std::string& what) {
  session->set_called();
  auto function = std::make_shared<LuaFunction>(session, L, index, 1);
  return [function, what](const ParticleView& view, std::span<const int> ids,
                          std::span<double> out) { function->call(view, ids, out, what); };
}

std::function<std::vector<double>(double)> make_exact(const std::shared_ptr<SceneSession>& session,
                                                      lua_State* L, int index, std::size_t size,
                                                      int dimension) {
  auto function = std::make_shared<LuaFunction>(session, L, index, dimension);
  return [function, size](double t) {
    std::vector<double> state(size);
    function->call(t, nullptr, state);
    for (const double value : state)
      if (!std::isfinite(value))
        scene_error(function->place(), "bad exact solution", "it is not finite at some t");
    return state;
  };
}

}  // namespace sim
