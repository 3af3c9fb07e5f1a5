#include "cli/command_line/line_plugins.h"

#include <algorithm>
#include <string_view>

#include "core/base/error.h"
#include "core/plugin/library.h"

namespace sim::cli {
namespace {

// Opens a library of --load if it brings studies; its errors are reported when all are opened.
void load_study(const std::filesystem::path& library, Registry& registry) {
  try {
    if (read_card(library).kind == kind_of<Study>.number) registry.load(library);
  } catch (const Error&) {
    return;
  }
}

}  // namespace

LinePlugins::LinePlugins(int argc, const char* const* argv) {
  for (int i = 1; i < argc && std::string_view(argv[i]) != "--"; ++i) {
    const std::string word = argv[i];
    const auto value = [&](const std::string& option, Folders& values) {
      if (word.starts_with(option + "="))
        values.emplace_back(word.substr(option.size() + 1));
      else if (word == option && i + 1 < argc)
        values.emplace_back(argv[++i]);
      else
        return false;
      return true;
    };
    if (value("--plugin-path", plugin_path_) || value("--load", libraries_)) continue;
    probe_ = probe_ || word == "--probe";
    words_.push_back(word);
  }
  // A machine that fails once must not make a study an unknown word; registry() reports the rest.
  for (int attempt = 0; attempt < 2 && !registry_; ++attempt) {
    try {
      registry_.reset(new Registry(open_registry(find_environment(plugin_path_), {}, probe_)));
    } catch (const Error&) {
      continue;
    }
  }
}

std::vector<const Plugin<Study>*> LinePlugins::studies() {
  std::vector<const Plugin<Study>*> found;
  if (!registry_) return found;
  const auto add = [&](const std::string& name) {
    const PluginInfo* const plugin = registry_->find(kind_of<Study>, name);
    if (plugin && std::ranges::find(found, plugin) == found.end())
      found.push_back(static_cast<const Plugin<Study>*>(plugin));
  };
  for (const std::filesystem::path& library : libraries_) load_study(library, *registry_);
  const bool asks_for_help = std::ranges::any_of(words_, [](const std::string& word) {
    return word == "help" || word == "-h" || word == "--help" || word == "--man";
  });
  if (!asks_for_help) {
    for (const std::string& word : words_) add(word);
    return found;
  }
  for (const std::string& name : names()) {
    try {
      add(name);
    } catch (const Error&) {
      continue;  // `sim doctor` tells
    }
  }
  return found;
}

std::vector<std::string> LinePlugins::names() const {
  return registry_ ? registry_->names<Study>() : std::vector<std::string>{};
}

Registry& LinePlugins::registry() {
  if (registry_)
    for (const std::filesystem::path& library : libraries_) registry_->load(library);
  else
    registry_.reset(
        new Registry(open_registry(find_environment(plugin_path_), libraries_, probe_)));
  return *registry_;
}

}  // namespace sim::cli
