// Parameters of plugins: declared once, in the registration, by which the values of scenes are
// checked.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/plugin/value.h"

namespace sim {

// One parameter: the only place where its name, default, unit, bounds and meaning are written.
struct Param {
  std::string name = {};
  ParamType type = ParamType::kNumber;
  Value default_value = {};  // none: see `required`
  std::string unit = {};
  std::string doc = {};
  bool required = false;    // a scene must say it; otherwise none is a legal value
  bool per_tie = false;     // a number that each element may give for itself: see Elements
  bool positional = false;  // may be given as the first unnamed entry of the Lua table
  double min = -std::numeric_limits<double>::infinity();  // bounds of a number, inclusive
  double max = std::numeric_limits<double>::infinity();
  std::vector<std::string> choices = {};  // for a text; none: any text
};

// Compiled once, in the kernel, as Value is.
class ParamList : public std::vector<Param> {
 public:
  ParamList();
  ParamList(std::initializer_list<Param> params);
  ParamList(const ParamList& other);
  ParamList(ParamList&& other) noexcept;
  ParamList& operator=(const ParamList& other);
  ParamList& operator=(ParamList&& other) noexcept;
  ~ParamList();
};

// The reason why a value of the right type is not allowed; empty if it is.
std::string objection(const Value& value, const Param& param);
// Converts defaults to the declared types: a whole number passes as a number. Returns the fault of
// the declarations - a name twice, a default of another type or out of bounds - or "".
std::string settle_defaults(std::span<Param> declared);

// A location in a scene: "scenes/cloth.lua:12", or empty.
using SourceLocation = std::string;

// Values for the parameters of one plugin. Reading a name that the plugin did not declare is an
// internal error; scenes cannot cause it.
class Params {
 public:
  Params() = default;

  // Checks `given` against `declared` and fills in the defaults; with `free_numbers` numbers of
  // other names are accepted. Throws Error{kScene} naming `owner` ("force 'spring'") and the place
  // for an unknown name, a wrong type or a bad value, or for a missing required one that elements
  // cannot give either.
  Params(const std::string& owner, std::span<const Param> declared,
         const std::map<std::string, Value>& given, const SourceLocation& place,
         bool free_numbers = false);

  bool has(std::string_view name) const;  // given or defaulted
  const Value& value(std::string_view name) const;
  bool flag(std::string_view name) const { return get<bool>(name); }
  std::int64_t integer(std::string_view name) const { return get<std::int64_t>(name); }
  double number(std::string_view name) const { return get<double>(name); }
  const std::string& text(std::string_view name) const { return get<std::string>(name); }
  const Vec3& vector(std::string_view name) const { return get<Vec3>(name); }
  const OdeFunction& function(std::string_view name) const { return get<OdeFunction>(name); }
  const std::shared_ptr<const TriangleMesh>& surface(std::string_view name) const {
    return get<std::shared_ptr<const TriangleMesh>>(name);
  }
  const std::shared_ptr<const RigidMotion>& motion(std::string_view name) const {
    return get<std::shared_ptr<const RigidMotion>>(name);
  }
  const std::shared_ptr<const ContactLaw>& law(std::string_view name) const {
    return get<std::shared_ptr<const ContactLaw>>(name);
  }
  const std::shared_ptr<const ColliderMaker>& collider(std::string_view name) const {
    return get<std::shared_ptr<const ColliderMaker>>(name);
  }
  const Colliders& colliders(std::string_view name) const { return get<Colliders>(name); }
  const Bodies& bodies(std::string_view name) const { return get<Bodies>(name); }
  const std::shared_ptr<const Curve>& curve(std::string_view name) const {
    return get<std::shared_ptr<const Curve>>(name);
  }
  const List& list(std::string_view name) const { return get<List>(name); }
  const ParticleFunction& particle_function(std::string_view name) const {
    return get<ParticleFunction>(name);
  }
  // The numbers that were given but not declared; number() has them, too.
  const std::map<std::string, double>& free_numbers() const { return free_numbers_; }

 private:
  template <class T>
  const T& get(std::string_view name) const;

  std::map<std::string, Value, std::less<>> values_;
  std::map<std::string, double> free_numbers_;
};

}  // namespace sim
