// The description of a plugin, and how its objects are made.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/plugin/elements.h"
#include "core/plugin/kinds.h"

namespace sim {

struct MethodChoice;  // core/plugin/method.h

// The single source of help, checks and `sim describe`.
struct PluginInfo {
  std::string name = {};
  std::string summary = {};  // one line
  std::string formula = {};  // the mathematics, one or more lines
  std::string source = {};   // author (year), equation; may be empty
  ParamList params = {};
  ElementKind elements = {};  // forces: the elements that they take
  bool pointwise = false;  // forces: the force on a particle depends on it alone, so that a scene
                           // may name the particles it acts on
  bool free_numbers =
      false;  // forces, fields: other names than those of `params` may be given numbers
  bool reads_particles = false;  // forces: Elements::carried is filled in
  // Memory, bytes, that an element takes besides the parts it joins, for an estimate before a run:
  // a tie, a cell, or a triangle of a surface.
  double element_bytes = 0;
  // Parameters with which it works, tied if it takes ties; not needed if the required ones may have
  // any value of their type.
  ValueMap example = {};

  std::vector<std::string> aliases = {};  // the rest is filled in by the registry
  PluginKind kind = {};
  std::string file = {};  // the library it came from, or "the program"

  // "force 'gravity'", as errors name it.
  std::string title() const;
};

template <class Object>
struct Plugin : PluginInfo {
  typename Kind<Object>::Make make;
};

// Another integrator, for a method built on others; throws as Method.
using OtherIntegrator = std::function<std::unique_ptr<Integrator>(const MethodChoice&)>;

template <>
struct Plugin<Integrator> : PluginInfo {
  Kind<Integrator>::Make make;
  // Replaces `make` for a method built on others, which it may request for as long as it lives.
  std::function<std::unique_ptr<Integrator>(const Params&, const OtherIntegrator&)>
      make_from_others = {};
};

// The object, or an error of the plugin if it made none.
template <class Object>
std::unique_ptr<Object> made(std::unique_ptr<Object> object, const PluginInfo& plugin) {
  if (object) return object;
  throw Error(ErrorKind::kPlugin,
              {"plugin", plugin.file, "'" + plugin.name + "' made nothing", ""});
}

using ForcePlugin = Plugin<Force>;
using FieldPlugin = Plugin<Field>;
using IntegratorPlugin = Plugin<Integrator>;

}  // namespace sim
