#include "core/plugin/registry.h"

#include <algorithm>
#include <deque>
#include <map>
#include <set>

#include "core/base/system_failure.h"
#include "core/base/text.h"
#include "core/plugin/library.h"
#include "core/plugin/probe.h"

namespace sim {

namespace fs = std::filesystem;

namespace {

// The "file" of linked plugins in errors and descriptions.
constexpr const char* kProgram = "the program";

// A name in two libraries. Unlike a broken library it is fatal: the kernel does not guess which of
// the two was meant.
struct Taken : Error {
  using Error::Error;
};

// Libraries below a directory and its folders of kinds, sorted, so that the order never depends on
// the file system.
std::vector<fs::path> libraries_below(const fs::path& directory) {
  std::vector<fs::path> files;
  std::vector<std::string_view> folders{""};
  for (const PluginKind& kind : kPluginKinds) folders.push_back(kind.folder);
  for (const std::string_view folder : folders) {
    std::error_code error;
    const fs::path place = folder.empty() ? directory : directory / folder;
    std::vector<fs::path> here;
    for (fs::directory_iterator it(place, error), end; !error && it != end; it.increment(error))
      if (it->path().extension() == ".so") here.push_back(it->path());
    if (error && (folder.empty() || is_machine_failure(error.value())))
      throw Error(ErrorKind::kIo, {"plugin folder", place.string(), error.message(),
                                   is_machine_failure(error.value())
                                       ? remedy_for(error.value())
                                       : "name a folder that holds plugin libraries"});
    std::sort(here.begin(), here.end());
    files.insert(files.end(), here.begin(), here.end());
  }
  return files;
}

}  // namespace

struct Registry::Impl {
  // A library in the search path, or its linked equivalent: the contents of its card, and whether
  // it has been opened.
  struct Library {
    fs::path file, canonical;
    PluginKind kind;
    std::vector<CardName> names;
    void (*enroll)(Registrar&) = nullptr;  // linked in: there is no file
    bool opened = false;
    std::uint64_t hash = 0;  // of its content, once it is open
  };

  // Collects the plugins that one library registers, and checks them against its card.
  struct Collector final : Registrar {
    Collector(Impl& owner, const Library& source) : impl(owner), library(source) {}
    void keep(std::shared_ptr<PluginInfo> plugin) override {
      const auto promised =
          std::find_if(library.names.begin(), library.names.end(),
                       [&](const CardName& entry) { return entry.name == plugin->name; });
      if (plugin->kind != library.kind || promised == library.names.end())
        refuse("it registers the " + plugin->title() + ", which its card does not name",
               "name it in SIM_PLUGIN");
      if (!registered.insert(plugin->name).second)
        refuse("it registers the " + plugin->title() + " twice", "register it once");
      if (const std::string wrong = settle_defaults(plugin->params); !wrong.empty())
        refuse(plugin->title() + ": " + wrong, "mend its declaration");
      plugin->aliases = promised->aliases;
      plugin->file = library.file.string();
      impl.of(library.kind).plugins.emplace(plugin->name, std::move(plugin));
    }

    [[noreturn]] void refuse(const std::string& why, const std::string& remedy) const {
      throw Error(ErrorKind::kPlugin, {"plugin", library.file.string(), why, remedy});
    }

    Impl& impl;
    const Library& library;
    std::set<std::string> registered;
  };

  // The known plugins of one kind.
  struct Shelf {
    std::map<std::string, std::size_t> owner;      // plugin name -> index of its library
    std::map<std::string, std::string> canonical;  // name or alias -> name
    std::map<std::string, std::shared_ptr<const PluginInfo>> plugins;  // of opened libraries
  };

  std::deque<Library> libraries;
  Shelf shelves[kPluginKinds.size()];
  std::vector<std::pair<fs::path, Error>> refused;
  std::vector<std::string> rejected;
  bool probe = false;

  Shelf& of(const PluginKind& kind) { return shelves[kind.number]; }

  // Enters the library of that file under its names; known already if it is the same file by
  // another path. A name that is taken is an error.
  Library& enter(const fs::path& file) {
    std::error_code failed;
    fs::path canonical = fs::canonical(file, failed);
    if (failed) canonical = file;
    const auto known = std::ranges::find(libraries, canonical, &Library::canonical);
    if (known != libraries.end()) return *known;

    const PluginCard card = read_card(file);
    return note({file, canonical, kPluginKinds[card.kind], card_names(card)});
  }

  void enter(const LinkedPlugin& linked) {
    const PluginCard card = checked_card(*linked.card, kProgram);
    note({kProgram, {}, kPluginKinds[card.kind], card_names(card), linked.enroll});
  }

  Library& note(Library library) {
    Shelf& shelf = of(library.kind);
    std::set<std::string> own;
    for (const CardName& entry : library.names) {
      std::vector<std::string> words = entry.aliases;
      words.push_back(entry.name);
      for (const std::string& word : words) {
        const auto taken = shelf.canonical.find(word);
        const bool known_name = taken != shelf.canonical.end();
        if (!known_name && own.insert(word).second) continue;
        const fs::path& other =
            known_name ? libraries[shelf.owner[taken->second]].file : library.file;
        throw Taken(ErrorKind::kPlugin, {"plugin", library.file.string(),
                                         "the " + std::string(library.kind.name) + " name '" +
                                             word + "' is taken by " + other.string(),
                                         "give one of them another name, or take it away"});
      }
    }
    for (const CardName& entry : library.names) {
      shelf.owner[entry.name] = libraries.size();
      shelf.canonical[entry.name] = entry.name;
      for (const std::string& alias : entry.aliases) shelf.canonical[alias] = entry.name;
    }
    return libraries.emplace_back(std::move(library));
  }

  void open(Library& library) {
    if (library.opened) return;
    Collector collector(*this, library);
    if (library.enroll) {
      enroll_plugins(library.file, library.enroll, collector);
    } else {
      if (probe) probe_library(library.file);
      library.hash = open_library(library.file, collector);
    }
    for (const CardName& entry : library.names)
      if (!collector.registered.count(entry.name))
        throw Error(ErrorKind::kPlugin,
                    {"plugin", library.file.string(),
                     "its card names '" + entry.name + "', but it does not register that",
                     "register it or take it off the card"});
    library.opened = true;
  }

  // The plugin, its library opened; null for an unknown name.
  const PluginInfo* find(const PluginKind& kind, const std::string& name) {
    Shelf& shelf = of(kind);
    const auto known = shelf.canonical.find(name);
    if (known == shelf.canonical.end()) return nullptr;
    open(libraries[shelf.owner[known->second]]);
    return shelf.plugins.at(known->second).get();
  }

  std::vector<std::string> names(const PluginKind& kind) const {
    std::vector<std::string> list;
    for (const auto& entry : shelves[kind.number].owner) list.push_back(entry.first);
    return list;
  }

  const PluginInfo& get(const PluginKind& kind, const std::string& name,
                        const SourceLocation& place) {
    if (const PluginInfo* const plugin = find(kind, name)) return *plugin;
    // A library of that name was found, but is unusable: its own reason helps more.
    for (const auto& [file, error] : refused)
      if (file.stem() == name) throw error;
    throw Error(
        ErrorKind::kScene,
        {"unknown " + std::string(kind.name) + " '" + name + "'", place, "no plugin has that name",
         suggestion(name, names(kind)) + "; a library of your own: --load FILE.so, or a folder of "
                                         "them: --plugin-path DIR"});
  }
};

Registry::Registry(const std::vector<fs::path>& directories, const std::vector<fs::path>& libraries,
                   bool probe, std::span<const LinkedPlugin> linked)
    : impl_(std::make_unique<Impl>()) {
  impl_->probe = probe;
  for (const LinkedPlugin& plugin : linked) impl_->enter(plugin);
  // A broken library must not prevent the use of others: it is reported when it is requested.
  for (const fs::path& directory : directories)
    for (const fs::path& file : libraries_below(directory)) {
      try {
        impl_->enter(file);
      } catch (const Taken&) {
        throw;
      } catch (const Error& error) {
        // Plugins that cannot be read now would be missing silently.
        if (error.kind() == ErrorKind::kIo) throw;
        impl_->refused.emplace_back(file, error);
        impl_->rejected.push_back(error.what());
      }
    }
  for (const fs::path& library : libraries) load(library);
}

Registry::~Registry() = default;

void Registry::load(const fs::path& library) { impl_->open(impl_->enter(fs::absolute(library))); }

const PluginInfo& Registry::get(const PluginKind& kind, const std::string& name,
                                const SourceLocation& place) {
  return impl_->get(kind, name, place);
}

std::vector<std::string> Registry::names(const PluginKind& kind) const {
  return impl_->names(kind);
}

const PluginInfo* Registry::find(const PluginKind& kind, const std::string& name) {
  return impl_->find(kind, name);
}

std::vector<const PluginInfo*> Registry::find(const std::string& name) {
  std::vector<const PluginInfo*> found;
  for (const PluginKind& kind : kPluginKinds)
    if (const PluginInfo* const plugin = find(kind, name)) found.push_back(plugin);
  return found;
}

std::vector<fs::path> Registry::libraries(bool opened) const {
  std::vector<fs::path> files;
  for (const Impl::Library& library : impl_->libraries)
    if (!library.enroll && (library.opened || !opened)) files.push_back(library.file);
  return files;
}

std::vector<InputFile> Registry::inputs() const {
  std::vector<InputFile> files;
  for (const Impl::Library& library : impl_->libraries)
    if (!library.enroll && library.opened &&
        (library.kind.in_scenes || library.kind == kind_of<ImplicitSolvers>))
      files.push_back({std::string(library.kind.name) + " '" + library.names.front().name + "'",
                       fs::absolute(library.file).string(), library.hash});
  return files;
}

const std::vector<std::string>& Registry::rejected() const { return impl_->rejected; }

}  // namespace sim
