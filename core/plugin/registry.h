// The registry: the plugins of a kernel, found by name and opened only when named.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/input_file.h"
#include "core/plugin/linked_plugins.h"
#include "core/plugin/method.h"
#include "core/plugin/plugin_info.h"

namespace sim {

class Registry {
 public:
  // Directories are searched in order; each has a folder for each kind, or holds the libraries.
  // None of these is opened yet; the `libraries` are, at once. A directory that cannot be read is
  // an error, and so is a name in two libraries. Methods refer to their registry, which outlives
  // them. `probe`: each library is probed first, see probe_library(). `linked` plugins are added.
  explicit Registry(const std::vector<std::filesystem::path>& directories,
                    const std::vector<std::filesystem::path>& libraries = {}, bool probe = false,
                    std::span<const LinkedPlugin> linked = {});
  ~Registry();
  Registry(const Registry&) = delete;
  Registry& operator=(const Registry&) = delete;

  // Opens a library now, unless it is open. Throws Error{kPlugin} with the reason.
  void load(const std::filesystem::path& library);

  // The plugin of that name or alias, opened on demand. Throws Error{kScene} for an unknown name
  // (with the nearest known one) and Error{kPlugin} for an unusable library.
  template <class Object>
  const Plugin<Object>& get(const std::string& name, const SourceLocation& place = {}) {
    return static_cast<const Plugin<Object>&>(get(kind_of<Object>, name, place));
  }
  const PluginInfo& get(const PluginKind& kind, const std::string& name,
                        const SourceLocation& place = {});

  // Names (no aliases) of one kind, sorted, without opening anything.
  template <class Object>
  std::vector<std::string> names() const {
    return names(kind_of<Object>);
  }
  std::vector<std::string> names(const PluginKind& kind) const;

  // The same, but null for an unknown name; and the plugins of that name of every kind.
  const PluginInfo* find(const PluginKind& kind, const std::string& name);
  std::vector<const PluginInfo*> find(const std::string& name);
  // The files of all usable libraries, or only of those that were opened.
  std::vector<std::filesystem::path> libraries(bool opened = false) const;
  // The open libraries that make the numbers of a scene, as they were when opened.
  std::vector<InputFile> inputs() const;
  // Libraries in the directories that cannot be used, with the reason.
  const std::vector<std::string>& rejected() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sim
