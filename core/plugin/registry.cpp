#include "core/plugin/registry.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "core/base/text.h"
#include "core/plugin/library.h"

namespace sim {

namespace fs = std::filesystem;

const char* kind_name(PluginKind kind) {
  constexpr const char* kNames[] = {"force", "field", "integrator"};
  return kNames[static_cast<int>(kind)];
}

namespace {

constexpr int kKinds = 3;

// Libraries below a directory and its folders of kinds, sorted, so that the order never depends on
// the file system.
std::vector<fs::path> libraries_below(const fs::path& directory) {
  std::vector<fs::path> files;
  for (const char* folder : {"", "forces", "fields", "integrators"}) {
    std::error_code error;
    const fs::path place = *folder ? directory / folder : directory;
    std::vector<fs::path> here;
    for (fs::directory_iterator it(place, error), end; !error && it != end; it.increment(error))
      if (it->path().extension() == ".so") here.push_back(it->path());
    if (error && !*folder)
      throw Error(ErrorKind::kIo, {"plugin folder", directory.string(), error.message(),
                                   "name a folder that holds plugin libraries"});
    std::sort(here.begin(), here.end());
    files.insert(files.end(), here.begin(), here.end());
  }
  return files;
}

}  // namespace

struct Registry::Impl {
  // A library in the search path: what its card promises, and whether it has been opened.
  struct Library {
    fs::path file;
    PluginKind kind;
    std::vector<CardName> names;
    bool opened = false;
  };

  // Takes what one library registers, and holds it to its card.
  struct Collector final : Registrar {
    Collector(Impl& owner, const Library& source) : impl(owner), library(source) {}
    void add(ForcePlugin plugin) override { keep(impl.forces, PluginKind::kForce, plugin); }
    void add(FieldPlugin plugin) override { keep(impl.fields, PluginKind::kField, plugin); }
    void add(IntegratorPlugin plugin) override {
      if (plugin.make_from_others)
        plugin.make = [make = plugin.make_from_others, &impl = impl](const Params& params) {
          return make(params, [&impl](const std::string& name, const auto& given) {
            return impl.make_integrator(name, given);
          });
        };
      keep(impl.integrators, PluginKind::kIntegrator, plugin);
    }

    template <class Plugin>
    void keep(std::map<std::string, Plugin>& into, PluginKind kind, Plugin& plugin) {
      const auto promised =
          std::find_if(library.names.begin(), library.names.end(),
                       [&](const CardName& entry) { return entry.name == plugin.name; });
      if (kind != library.kind || promised == library.names.end())
        throw Error(ErrorKind::kPlugin, {"plugin", library.file.string(),
                                         std::string("it registers the ") + kind_name(kind) + " '" +
                                             plugin.name + "', which its card does not name",
                                         "name it in SIM_PLUGIN"});
      plugin.kind = kind;
      plugin.aliases = promised->aliases;
      plugin.file = library.file.string();
      registered.insert(plugin.name);
      into.emplace(plugin.name, std::move(plugin));
    }

    Impl& impl;
    const Library& library;
    std::set<std::string> registered;
  };

  std::vector<Library> libraries;
  std::map<std::string, std::size_t> owner[kKinds];      // plugin name -> index of its library
  std::map<std::string, std::string> canonical[kKinds];  // name or alias -> name
  std::map<std::string, ForcePlugin> forces;
  std::map<std::string, FieldPlugin> fields;
  std::map<std::string, IntegratorPlugin> integrators;
  std::vector<std::pair<fs::path, Error>> refused;
  std::vector<std::string> rejected;

  // Notes a library under its names. A name that is taken already is an error.
  Library& enter(const fs::path& file) {
    const PluginCard card = read_card(file);
    Library library{file, static_cast<PluginKind>(card.kind), card_names(card)};
    const auto kind = static_cast<std::size_t>(card.kind);
    for (const CardName& entry : library.names) {
      std::vector<std::string> words = entry.aliases;
      words.push_back(entry.name);
      for (const std::string& word : words)
        if (const auto taken = canonical[kind].find(word); taken != canonical[kind].end())
          throw Error(ErrorKind::kPlugin,
                      {"plugin", file.string(),
                       std::string("the ") + kind_name(library.kind) + " name '" + word +
                           "' is taken by " + libraries[owner[kind][taken->second]].file.string(),
                       "give it another name"});
    }
    for (const CardName& entry : library.names) {
      owner[kind][entry.name] = libraries.size();
      canonical[kind][entry.name] = entry.name;
      for (const std::string& alias : entry.aliases) canonical[kind][alias] = entry.name;
    }
    libraries.push_back(std::move(library));
    return libraries.back();
  }

  void open(Library& library) {
    if (library.opened) return;
    Collector collector(*this, library);
    open_library(library.file, collector);
    for (const CardName& entry : library.names)
      if (!collector.registered.count(entry.name))
        throw Error(ErrorKind::kPlugin,
                    {"plugin", library.file.string(),
                     "its card names '" + entry.name + "', but it does not register that",
                     "register it or take it off the card"});
    library.opened = true;
  }

  std::vector<std::string> names(PluginKind kind) const {
    std::vector<std::string> list;
    for (const auto& entry : owner[static_cast<int>(kind)]) list.push_back(entry.first);
    return list;
  }

  // The canonical name, its library opened; nothing for an unknown name.
  std::optional<std::string> resolve(PluginKind kind, const std::string& name) {
    const auto index = static_cast<std::size_t>(kind);
    const auto known = canonical[index].find(name);
    if (known == canonical[index].end()) return {};
    open(libraries[owner[index][known->second]]);
    return known->second;
  }

  std::unique_ptr<Integrator> make_integrator(const std::string& name,
                                              const std::map<std::string, Value>& given) {
    const IntegratorPlugin& plugin = get(integrators, PluginKind::kIntegrator, name, {});
    return plugin.make(Params("integrator '" + plugin.name + "'", plugin.params, given, {}));
  }

  template <class Plugin>
  const Plugin& get(std::map<std::string, Plugin>& from, PluginKind kind, const std::string& name,
                    const Place& place) {
    const auto known = resolve(kind, name);
    // A library of that name was there, but could not be used: its own reason helps more.
    if (!known)
      for (const auto& [file, error] : refused)
        if (file.stem() == name) throw error;
    if (!known)
      throw Error(ErrorKind::kScene,
                  {std::string("unknown ") + kind_name(kind) + " '" + name + "'", place,
                   "no plugin has that name", suggestion(name, names(kind))});
    return from.at(*known);
  }
};

Registry::Registry(std::vector<fs::path> directories) : impl_(std::make_unique<Impl>()) {
  // A broken library must not keep the others from being used: it is told when it is asked for.
  for (const fs::path& directory : directories)
    for (const fs::path& file : libraries_below(directory)) {
      try {
        impl_->enter(file);
      } catch (const Error& error) {
        impl_->refused.emplace_back(file, error);
        impl_->rejected.push_back(error.what());
      }
    }
}

Registry::~Registry() = default;
Registry::Registry(Registry&&) noexcept = default;
Registry& Registry::operator=(Registry&&) noexcept = default;

void Registry::load(const fs::path& library) { impl_->open(impl_->enter(fs::absolute(library))); }

const ForcePlugin& Registry::force(const std::string& name, const Place& place) {
  return impl_->get(impl_->forces, PluginKind::kForce, name, place);
}

const FieldPlugin& Registry::field(const std::string& name, const Place& place) {
  return impl_->get(impl_->fields, PluginKind::kField, name, place);
}

const IntegratorPlugin& Registry::integrator(const std::string& name, const Place& place) {
  return impl_->get(impl_->integrators, PluginKind::kIntegrator, name, place);
}

std::vector<std::string> Registry::names(PluginKind kind) const { return impl_->names(kind); }

const PluginInfo* Registry::find(const std::string& name) {
  if (const auto known = impl_->resolve(PluginKind::kIntegrator, name))
    return &impl_->integrators.at(*known);
  if (const auto known = impl_->resolve(PluginKind::kForce, name)) return &impl_->forces.at(*known);
  if (const auto known = impl_->resolve(PluginKind::kField, name)) return &impl_->fields.at(*known);
  return nullptr;
}

const std::vector<std::string>& Registry::rejected() const { return impl_->rejected; }

}  // namespace sim
