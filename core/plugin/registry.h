// The plugins one kernel can use: found by name, opened only when named.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/plugin/elements.h"
#include "core/plugin/kinds.h"
#include "core/plugin/method.h"

namespace sim {

// What a plugin says of itself; help, checks and `sim describe` all come from here.
struct PluginInfo {
  std::string name = {};
  std::string summary = {};  // one line
  std::string formula = {};  // the mathematics, one or more lines
  std::string source = {};   // author (year), equation; may be empty
  std::vector<Param> params = {};
  ElementKind elements = {};  // forces: what a scene may tie to it
  bool pointwise = false;  // forces: the force on a particle depends on it alone, so that a scene
                           // may name the particles it acts on
  bool free_numbers = false;  // forces: other names than those of `params` may be given numbers
  // Parameters with which it works, tied where it takes ties; not needed where those that are
  // required may have any value of their type.
  std::map<std::string, Value> example = {};

  std::vector<std::string> aliases = {};  // the rest is filled in by the registry
  PluginKind kind = {};
  std::string file = {};  // the library it came from

  // "force 'gravity'", as errors name it.
  std::string title() const { return std::string(kind.name) + " '" + name + "'"; }
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
  // Instead of `make`, for a method built on others, which it may ask for as long as it lives.
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

class Registry {
 public:
  // Directories are searched in order; each has a folder for each kind, or holds the libraries.
  // Nothing of them is opened yet; the `libraries` are, at once. A directory that cannot be read is
  // an error, and so is a name that two libraries have. Methods refer to their registry: it stays.
  // `probe`: each library is tried first, see probe_library().
  explicit Registry(const std::vector<std::filesystem::path>& directories,
                    const std::vector<std::filesystem::path>& libraries = {}, bool probe = false);
  ~Registry();
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;

  // Opens one now, unless it is open. Throws Error{kPlugin} with the reason.
  void load(const std::filesystem::path& library);

  // The plugin of that name or alias, opened if it was not. Throws Error{kScene} for an unknown
  // name (with the nearest known one) and Error{kPlugin} for a library that cannot be used.
  template <class Object>
  const Plugin<Object>& get(const std::string& name, const Place& place = {}) {
    return static_cast<const Plugin<Object>&>(get(kind_of<Object>, name, place));
  }
  const PluginInfo& get(const PluginKind& kind, const std::string& name, const Place& place = {});

  // Names (no aliases) of one kind, sorted, without opening anything.
  template <class Object>
  std::vector<std::string> names() const {
    return names(kind_of<Object>);
  }
  std::vector<std::string> names(const PluginKind& kind) const;

  // The same, but null for an unknown name; and every kind's plugin of that name.
  const PluginInfo* find(const PluginKind& kind, const std::string& name);
  std::vector<const PluginInfo*> find(const std::string& name);
  // Libraries that were found in the directories but cannot be used, with the reason.
  const std::vector<std::string>& rejected() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sim
