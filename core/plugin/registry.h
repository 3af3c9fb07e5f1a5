// The plugins one kernel can use: found by name, opened only when named.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/fields/field.h"
#include "core/ode/integrator.h"
#include "core/particles/force.h"
#include "core/plugin/links.h"
#include "core/plugin/params.h"

namespace sim {

enum class PluginKind { kForce, kField, kIntegrator };

const char* kind_name(PluginKind kind);  // "force", "field", "integrator"

// What a plugin says of itself; help, checks and `sim describe` all come from here.
struct PluginInfo {
  std::string name = {};
  std::string summary = {};  // one line
  std::string formula = {};  // the mathematics, one or more lines
  std::string source = {};   // author (year), equation; may be empty
  std::vector<Param> params = {};
  bool takes_links = false;   // forces: a scene may tie pairs of particles to it
  bool free_numbers = false;  // forces: other names than those of `params` may be given numbers
  // Parameters with which it works, tied where it takes ties; not needed where those that are
  // required may have any value of their type.
  std::map<std::string, Value> example = {};

  std::vector<std::string> aliases = {};  // the rest is filled in by the registry
  PluginKind kind = PluginKind::kForce;
  std::string file = {};  // the library it came from
};

using MakeForce = std::function<std::unique_ptr<Force>(const Params&, const Links&)>;
using MakeField = std::function<std::unique_ptr<Field>(const Params&)>;
using MakeIntegrator = std::function<std::unique_ptr<Integrator>(const Params&)>;

// Another integrator by its name, with values for its parameters; throws as Registry::integrator.
using OtherIntegrator = std::function<std::unique_ptr<Integrator>(
    const std::string& name, const std::map<std::string, Value>& given)>;

struct ForcePlugin : PluginInfo {
  MakeForce make;
};
struct FieldPlugin : PluginInfo {
  MakeField make;
};
struct IntegratorPlugin : PluginInfo {
  MakeIntegrator make;
  // Instead of `make`, for a method built on others, which it may ask for as long as it lives.
  std::function<std::unique_ptr<Integrator>(const Params&, const OtherIntegrator&)>
      make_from_others = {};
};

class Registry {
 public:
  // Directories are searched in order; each has the folders forces/, fields/ and integrators/, or
  // holds libraries directly. Nothing is opened yet. A directory that cannot be read is an error.
  explicit Registry(std::vector<std::filesystem::path> directories);
  ~Registry();
  Registry(Registry&&) noexcept;
  Registry& operator=(Registry&&) noexcept;

  // Opens one library now. Throws Error{kPlugin} with the reason.
  void load(const std::filesystem::path& library);

  // The plugin of that name or alias, opened if it was not. Throws Error{kScene} for an unknown
  // name (with the nearest known one) and Error{kPlugin} for a library that cannot be used.
  const ForcePlugin& force(const std::string& name, const Place& place = {});
  const FieldPlugin& field(const std::string& name, const Place& place = {});
  const IntegratorPlugin& integrator(const std::string& name, const Place& place = {});

  // Names (no aliases) of one kind, sorted, without opening anything.
  std::vector<std::string> names(PluginKind kind) const;

  // Whatever the kind: the plugin's own words, opened if need be; null when no plugin has the name.
  const PluginInfo* find(const std::string& name);

  // Libraries that were found in the directories but cannot be used, with the reason.
  const std::vector<std::string>& rejected() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sim
