// Values that a scene gives to the parameters of plugins.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/math/vec3.h"
#include "core/particles/view.h"

namespace sim {

class Collider;
class ContactLaw;
class Curve;
class RigidBody;
class RigidMotion;
class TriangleMesh;

// dxdt := f(t, x); both spans have the size of the state.
using OdeFunction =
    std::function<void(double t, std::span<const double> x, std::span<double> dxdt)>;

// A function of single particles, f(t, i, x, v): its numbers for each id, one id after the other;
// their count per id follows from the size of `out`. One thread at a time. May throw Error{kScene}.
using ParticleFunction =
    std::function<void(const ParticleView& view, std::span<const int> ids, std::span<double> out)>;

// A collider given in a scene: each user gets an instance of its own.
struct ColliderMaker {
  std::function<std::unique_ptr<Collider>()> make;
  std::string text;  // its text in the scene
};

using Colliders = std::vector<std::shared_ptr<const ColliderMaker>>;
using List = std::vector<std::variant<double, std::string>>;   // of numbers and texts
using Bodies = std::vector<std::shared_ptr<const RigidBody>>;  // of the scene

// monostate: no value given.
using AnyValue = std::variant<std::monostate, bool, std::int64_t, double, std::string, Vec3,
                              OdeFunction, ParticleFunction, std::shared_ptr<const TriangleMesh>,
                              std::shared_ptr<const RigidMotion>,
                              std::shared_ptr<const ColliderMaker>, std::shared_ptr<const Curve>,
                              Colliders, Bodies, List, std::shared_ptr<const ContactLaw>>;

// Here and in ValueMap, the members that every plugin uses are compiled once, in the kernel.
class Value : public AnyValue {
 public:
  Value();
  Value(bool flag);
  Value(std::int64_t integer);
  Value(double number);
  Value(std::string text);
  Value(Vec3 vector);
  using AnyValue::AnyValue;  // conversions follow the rules of std::variant
  Value(const Value& other);
  Value(Value&& other) noexcept;
  Value& operator=(const Value& other);
  Value& operator=(Value&& other) noexcept;
  ~Value();
};

// Values by the names of parameters.
class ValueMap : public std::map<std::string, Value> {
 public:
  ValueMap();
  ValueMap(std::initializer_list<value_type> values);
  ValueMap(const ValueMap& other);
  ValueMap(ValueMap&& other) noexcept;
  ValueMap& operator=(const ValueMap& other);
  ValueMap& operator=(ValueMap&& other) noexcept;
  ~ValueMap();
};

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
  kBodies,     // rigid ones, as well
  kCurve,
  kList,  // of numbers and texts, or a single one
  kPath,  // a vector, or one that changes with time: held as a motion
  kLaw    // of contact
};

const char* type_name(ParamType type);    // "number", "vector {x, y, z}", ...
std::string to_text(const Value& value);  // "0.5", "{0, -9.81, 0}", "" for none

}  // namespace sim
