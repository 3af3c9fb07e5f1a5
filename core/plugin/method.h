// A method of integration with values for its parameters: as requested, and as resolved.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "core/plugin/params.h"

namespace sim {

class Integrator;
class Registry;
template <class Object>
struct Plugin;

// A choice of method and its values. Without a name the values are for the method that a scene
// names itself.
struct MethodChoice {
  std::string name;
  std::map<std::string, Value> given;  // parameters

  MethodChoice() = default;
  MethodChoice(const char* method) : name(method) {}
  MethodChoice(std::string method, std::map<std::string, Value> values = {})
      : name(std::move(method)), given(std::move(values)) {}

  // This choice if it names a method, or else `own` with the values given here replacing its own.
  MethodChoice over(const MethodChoice& own) const;

  // True if names and values are equal as text.
  friend bool operator==(const MethodChoice& a, const MethodChoice& b);
};

// A method that exists, with checked values. A value; its registry must outlive it.
class Method {
 public:
  // Throws the errors of Registry::get and Params.
  Method(Registry& registry, const MethodChoice& choice, const SourceLocation& place = {});
  Method(Registry& registry, const Plugin<Integrator>& plugin,
         std::map<std::string, Value> given = {}, const SourceLocation& place = {});

  const Plugin<Integrator>& plugin() const { return *plugin_; }
  const std::string& name() const { return choice_.name; }
  const MethodChoice& choice() const { return choice_; }  // under the plugin's own name
  Registry& registry() const { return *registry_; }
  const Params& params() const { return params_; }

  // NAME or NAME:PARAM=VALUE,..., as --integrator takes it; defaults are left out.
  std::string label() const;

  // Throws Error{kPlugin} if the plugin makes nothing.
  std::unique_ptr<Integrator> make() const;

 private:
  Registry* registry_;
  const Plugin<Integrator>* plugin_;
  MethodChoice choice_;
  Params params_;
};

}  // namespace sim
