// Functions of a scene that outlive its loading: right-hand sides and exact solutions.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/lua/scene/session.h"

namespace sim {

class Curve;
class RigidMotion;

// The Lua function at `index` as dxdt := f(t, x). Lua gets and gives the state in the form of the
// scene: a list of vectors for dimension 3, a flat list for dimension 1. Numbers that are not
// finite pass, so that a run can diverge; anything else but the right count of numbers throws
// Error{kScene} at the line of the function. The session stays alive with it.
OdeFunction make_ode_function(const std::shared_ptr<SceneSession>& session, lua_State* L, int index,
                              int dimension);

// Wraps f(t, i, x, v) for particle i at x = {x, y, z} with velocity v; it returns its numbers one
// by one. Both tables are the same at every call, with other numbers. `what` names it in errors.
ParticleFunction make_particle_function(const std::shared_ptr<SceneSession>& session, lua_State* L,
                                        int index, const std::string& what);

// The function(t) as the motion of a solid: it returns where the center is and, if it likes, its
// velocity, which differences give otherwise. Anything but numbers that are finite throws
// Error{kScene} at the line of the function.
std::shared_ptr<const RigidMotion> make_motion_function(
    const std::shared_ptr<SceneSession>& session, lua_State* L, int index, const std::string& what);

// The function(s) or function(s, t) as a curve; what is no vector of finite numbers throws
// Error{kScene} at the line of the function.
std::shared_ptr<const Curve> make_curve_function(const std::shared_ptr<SceneSession>& session,
                                                 lua_State* L, int index, const std::string& what);

// Wraps an exact solution of `size` numbers, which must be finite; see make_ode_function.
std::function<std::vector<double>(double)> make_exact(const std::shared_ptr<SceneSession>& session,
                                                      lua_State* L, int index, std::size_t size,
                                                      int dimension);

}  // namespace sim
