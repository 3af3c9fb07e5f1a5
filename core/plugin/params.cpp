#include "core/plugin/params.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/geometry/rigid_motion.h"
#include "core/particles/rigid/rigid_body.h"

namespace sim {
namespace {

ParamType type_of(const Value& value) {
  switch (value.index()) {
    case 1:
      return ParamType::kFlag;
    case 2:
      return ParamType::kInteger;
    case 3:
      return ParamType::kNumber;
    case 4:
      return ParamType::kText;
    case 5:
      return ParamType::kVector;
    case 6:
      return ParamType::kFunction;
    case 7:
      return ParamType::kParticleFunction;
    case 8:
      return ParamType::kSurface;
    case 9:
      return ParamType::kMotion;
    case 10:
      return ParamType::kCollider;
    case 12:
      return ParamType::kColliders;
    case 13:
      return ParamType::kBodies;
    case 14:
      return ParamType::kList;
    case 15:
      return ParamType::kLaw;
    default:
      return ParamType::kCurve;
  }
}

// The text of a value in an error message.
std::string shown(const Value& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return "'" + *text + "'";
  const ParamType type = type_of(value);
  if (type == ParamType::kFunction || type == ParamType::kParticleFunction) return "a function";
  if (type == ParamType::kSurface) return "a surface";
  if (type == ParamType::kMotion) return "a motion";
  if (type == ParamType::kLaw) return "a law of contact";
  if (type == ParamType::kCollider) return "a collider";
  if (type == ParamType::kColliders) return "a list of colliders";
  if (type == ParamType::kBodies) return "a list of bodies";
  if (type == ParamType::kCurve) return "a function";
  return to_text(value);
}

bool is_number(const Value& value) {
  return std::holds_alternative<double>(value) || std::holds_alternative<std::int64_t>(value);
}

// The path of a single point.
class AtRest final : public RigidMotion {
 public:
  explicit AtRest(const Vec3& place) : place_(place) {}
  Pose at(double /*t*/, const Vec3& /*center*/) const override { return {.center = place_}; }
  bool rests() const override { return true; }

 private:
  Vec3 place_;
};

// The value as the declared type; integers pass as numbers, whole numbers as integers.
bool convert(Value& value, ParamType type) {
  if (type_of(value) == type) return true;
  if (type == ParamType::kPath && type_of(value) == ParamType::kMotion) return true;
  if (type == ParamType::kPath && type_of(value) == ParamType::kVector) {
    value = std::make_shared<const AtRest>(std::get<Vec3>(value));
    return true;
  }
  if (type == ParamType::kColliders && type_of(value) == ParamType::kCollider) {
    value = Colliders{std::get<std::shared_ptr<const ColliderMaker>>(value)};
    return true;
  }
  if (type == ParamType::kList) {
    if (const auto* text = std::get_if<std::string>(&value))
      value = List{*text};
    else if (const auto* number = std::get_if<double>(&value))
      value = List{*number};
    else if (const auto* integer = std::get_if<std::int64_t>(&value))
      value = List{static_cast<double>(*integer)};
    else if (const auto* vector = std::get_if<Vec3>(&value))
      value = List{(*vector)[0], (*vector)[1], (*vector)[2]};
    else
      return false;
    return true;
  }
  if (type == ParamType::kNumber && std::holds_alternative<std::int64_t>(value)) {
    value = static_cast<double>(std::get<std::int64_t>(value));
    return true;
  }
  if (type == ParamType::kInteger && std::holds_alternative<double>(value)) {
    const double number = std::get<double>(value);
    if (std::floor(number) != number || std::fabs(number) > 9e15) return false;
    value = static_cast<std::int64_t>(number);
    return true;
  }
  return false;
}

}  // namespace

ParamList::ParamList() = default;
ParamList::ParamList(std::initializer_list<Param> params) : vector(params) {}
ParamList::ParamList(const ParamList& other) = default;
ParamList::ParamList(ParamList&& other) noexcept = default;
ParamList& ParamList::operator=(const ParamList& other) = default;
ParamList& ParamList::operator=(ParamList&& other) noexcept = default;
ParamList::~ParamList() = default;

std::string objection(const Value& value, const Param& param) {
  double number = 0;
  if (const auto* v = std::get_if<Vec3>(&value))
    return v->allFinite() ? "" : "every component must be finite";
  if (const auto* d = std::get_if<double>(&value))
    number = *d;
  else if (const auto* i = std::get_if<std::int64_t>(&value))
    number = static_cast<double>(*i);
  else if (const auto* text = std::get_if<std::string>(&value))
    return param.choices.empty() || std::ranges::count(param.choices, *text)
               ? ""
               : "it is one of: " + join(param.choices, ", ");
  else
    return "";
  if (!std::isfinite(number)) return "it must be finite";
  if (number < param.min) return "it must be at least " + shortest(param.min);
  if (number > param.max) return "it must be at most " + shortest(param.max);
  return "";
}

const char* type_name(ParamType type) {
  switch (type) {
    case ParamType::kFlag:
      return "true or false";
    case ParamType::kInteger:
      return "whole number";
    case ParamType::kNumber:
      return "number";
    case ParamType::kText:
      return "text";
    case ParamType::kVector:
      return "vector {x, y, z}";
    case ParamType::kFunction:
    case ParamType::kParticleFunction:
      return "function";
    case ParamType::kSurface:
      return "surface (sim.surface)";
    case ParamType::kMotion:
      return "motion (sim.motion) or function(t)";
    case ParamType::kCollider:
      return "collider (sim.collider)";
    case ParamType::kColliders:
      return "list of colliders";
    case ParamType::kBodies:
      return "list of bodies (sim.rigid)";
    case ParamType::kCurve:
      return "function(s) or function(s, t)";
    case ParamType::kPath:
      return "vector {x, y, z} or function(t)";
    case ParamType::kList:
      return "list of numbers or texts";
    case ParamType::kLaw:
      return "law of contact (sim.law)";
  }
  return "";
}

std::string to_text(const Value& value) {
  struct TextOf {
    std::string operator()(std::monostate) const { return ""; }
    std::string operator()(bool b) const { return b ? "true" : "false"; }
    std::string operator()(std::int64_t i) const { return std::to_string(i); }
    std::string operator()(double d) const { return shortest(d); }
    std::string operator()(const std::string& s) const { return s; }
    std::string operator()(const Vec3& v) const {
      std::string text = "{";
      for (int axis = 0; axis < 3; ++axis) {
        if (axis) text += ", ";
        append_number(text, v[axis]);
      }
      return text += '}';
    }
    std::string operator()(const OdeFunction&) const { return "function"; }
    std::string operator()(const std::shared_ptr<const TriangleMesh>&) const { return "surface"; }
    std::string operator()(const std::shared_ptr<const RigidMotion>& motion) const {
      return motion->rests() ? (*this)(motion->at(0, Vec3::Zero()).center) : "motion";
    }
    std::string operator()(const std::shared_ptr<const Curve>&) const { return "function"; }
    std::string operator()(const std::shared_ptr<const ContactLaw>&) const { return "law"; }
    std::string operator()(const std::shared_ptr<const ColliderMaker>& collider) const {
      return collider->text;
    }
    std::string operator()(const Colliders& colliders) const {
      std::vector<std::string> texts;
      for (const auto& collider : colliders) texts.push_back(collider->text);
      return "{" + join(texts, ", ") + "}";
    }
    std::string operator()(const Bodies& bodies) const {
      std::vector<std::string> texts;  // by the first of its particles, as no other body
      for (const auto& body : bodies) texts.push_back("body " + std::to_string(body->first()));
      return "{" + join(texts, ", ") + "}";
    }
    std::string operator()(const List& list) const {
      std::vector<std::string> texts;
      for (const auto& entry : list)
        texts.push_back(std::holds_alternative<double>(entry) ? shortest(std::get<double>(entry))
                                                              : "\"" + std::get<1>(entry) + "\"");
      return "{" + join(texts, ", ") + "}";
    }
    std::string operator()(const ParticleFunction&) const { return "function"; }
  };
  return std::visit(TextOf{}, value);
}

std::string settle_defaults(std::span<Param> declared) {
  std::set<std::string> names;
  for (Param& param : declared) {
    const std::string what = "the parameter '" + param.name + "'";
    if (!names.insert(param.name).second) return what + " is declared twice";
    Value& value = param.default_value;
    if (std::holds_alternative<std::monostate>(value)) continue;
    const std::string text = "the default of " + what + " is " + shown(value);
    if (!convert(value, param.type)) return text + ", not a " + type_name(param.type);
    if (const std::string why = objection(value, param); !why.empty()) return text + ": " + why;
  }
  return "";
}

Params::Params(const std::string& owner, std::span<const Param> declared,
               const std::map<std::string, Value>& given, const SourceLocation& place,
               bool free_numbers) {
  std::vector<std::string> known;
  for (const Param& param : declared) {
    known.push_back(param.name);
    values_[param.name] = param.default_value;
  }
  const Param free{};
  for (const auto& entry : given) {
    const std::string& name = entry.first;
    const Value& value = entry.second;
    const auto found = std::find_if(declared.begin(), declared.end(),
                                    [&](const Param& p) { return p.name == name; });
    const bool is_free = found == declared.end() && free_numbers && is_number(value);
    if (found == declared.end() && !is_free)
      throw Error(ErrorKind::kScene,
                  {owner, place, "it has no parameter '" + name + "'", suggestion(name, known)});
    const Param* const param = is_free ? &free : &*found;
    Value& slot = values_[name] = value;
    const std::string unit = param->unit.empty() ? "" : " in " + param->unit;
    if (!convert(slot, param->type))
      throw Error(ErrorKind::kScene, {owner, place, name + " is " + shown(value),
                                      std::string("give a ") + type_name(param->type) + unit});
    if (const std::string why = objection(slot, *param); !why.empty())
      throw Error(ErrorKind::kScene, {owner, place, name + " is " + shown(value), why});
    if (is_free) free_numbers_[name] = std::get<double>(slot);
  }
  for (const Param& param : declared)
    if (param.required && !param.per_tie && !has(param.name))
      throw Error(ErrorKind::kScene, {owner, place, "its parameter '" + param.name + "' is missing",
                                      "give " + param.name + ", " + param.doc +
                                          (param.unit.empty() ? "" : " in " + param.unit)});
}

bool Params::has(std::string_view name) const {
  const auto entry = values_.find(name);
  return entry != values_.end() && !std::holds_alternative<std::monostate>(entry->second);
}

const Value& Params::value(std::string_view name) const {
  const auto entry = values_.find(name);
  if (entry == values_.end()) throw std::out_of_range("no parameter '" + std::string(name) + "'");
  return entry->second;
}

template <class T>
const T& Params::get(std::string_view name) const {
  const auto entry = values_.find(name);
  if (entry == values_.end() || !std::holds_alternative<T>(entry->second))
    throw std::logic_error("parameter '" + std::string(name) +
                           "' was read but is not declared with that type");
  return std::get<T>(entry->second);
}

template const bool& Params::get(std::string_view) const;
template const std::int64_t& Params::get(std::string_view) const;
template const double& Params::get(std::string_view) const;
template const std::string& Params::get(std::string_view) const;
template const Vec3& Params::get(std::string_view) const;
template const OdeFunction& Params::get(std::string_view) const;
template const std::shared_ptr<const TriangleMesh>& Params::get(std::string_view) const;
template const List& Params::get(std::string_view) const;
template const ParticleFunction& Params::get(std::string_view) const;
template const std::shared_ptr<const ColliderMaker>& Params::get(std::string_view) const;
template const Colliders& Params::get(std::string_view) const;
template const Bodies& Params::get(std::string_view) const;
template const std::shared_ptr<const RigidMotion>& Params::get(std::string_view) const;
template const std::shared_ptr<const Curve>& Params::get(std::string_view) const;
template const std::shared_ptr<const ContactLaw>& Params::get(std::string_view) const;

}  // namespace sim
