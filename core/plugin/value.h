// Values that a scene gives to the parameters of plugins.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/math/vec3.h"
#include "core/particles/view.h"

namespace sim {

class Collider;
class Curve;
class RigidMotion;
class TriangleMesh;

// dxdt := f(t, x); both spans have the size of the state.
using OdeFunction =
    std::function<void(double t, std::span<const double> x, std::span<double> dxdt)>;

// A function of single particles, f(t, i, x, v): its numbers for each id, one id after the other;
// how many an id, the size of `out` says. One thread at a time. May throw Error{kScene}.
using ParticleFunction =
    std::function<void(const ParticleView& view, std::span<const int> ids, std::span<double> out)>;

// A collider that a scene names: each user has one of its own.
struct ColliderMaker {
  std::function<std::unique_ptr<Collider>()> make;
  std::string text;  // what the scene says of it
};

using Colliders = std::vector<std::shared_ptr<const ColliderMaker>>;

// monostate: no value given.
using Value = std::variant<std::monostate, bool, std::int64_t, double, std::string, Vec3,
                           OdeFunction, ParticleFunction, std::shared_ptr<const TriangleMesh>,
                           std::shared_ptr<const RigidMotion>, std::shared_ptr<const ColliderMaker>,
                           std::shared_ptr<const Curve>, Colliders>;

enum class ParamType {
  kFlag,
  kInteger,
  kNumber,
  kText,
  kVector,
  kFunction,
  kParticleFunction,
  kSurface,
  kMotion,
  kCollider,
  kColliders,  // a list of them, or one
  kCurve,
  kPath  // a vector, or one that changes with time: held as a motion
};

const char* type_name(ParamType type);    // "number", "vector {x, y, z}", ...
std::string to_text(const Value& value);  // "0.5", "{0, -9.81, 0}", "" for none

}  // namespace sim
