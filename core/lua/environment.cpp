#include "core/lua/environment.h"

#include <cstdlib>
#include <string_view>

namespace sim {
namespace {

namespace fs = std::filesystem;

void append_variable(Folders& folders, const char* variable) {
  const char* value = std::getenv(variable);
  std::string_view rest = value ? value : "";
  while (!rest.empty()) {
    const std::size_t colon = rest.find(':');
    if (colon != 0) folders.emplace_back(rest.substr(0, colon));
    rest = colon == std::string_view::npos ? std::string_view() : rest.substr(colon + 1);
  }
}

void append_if_present(Folders& folders, const fs::path& folder) {
  std::error_code error;
  if (fs::is_directory(folder, error)) folders.push_back(folder);
}

// The folder of user data, by the XDG base directory specification; empty if there is no home.
fs::path data_home() {
  const char* const data = std::getenv("XDG_DATA_HOME");
  if (data && *data == '/') return data;
  const char* const home = std::getenv("HOME");
  return home && *home ? fs::path(home) / ".local/share" : fs::path();
}

}  // namespace

fs::path library_folder(const fs::path& prefix) { return prefix / SIM_LIBDIR; }

fs::path page_with_kernel(const fs::path& prefix) {
  std::error_code error;
  const fs::path data = prefix / "share/sim", installed = data / "web/page.html";
  const fs::path tree = fs::weakly_canonical(data, error).parent_path();
  return fs::is_regular_file(installed, error) ? installed : tree / "build/web/page.html";
}

Environment find_environment(const fs::path& prefix, const Folders& plugin_path) {
  Environment environment;
  environment.plugin_folders = plugin_path;
  append_variable(environment.plugin_folders, "SIM_PLUGIN_PATH");
  if (const fs::path data = data_home(); !data.empty())
    append_if_present(environment.plugin_folders, data / "sim/plugins");
  append_if_present(environment.plugin_folders, library_folder(prefix) / "plugins");
  append_variable(environment.scene_folders, "SIM_PATH");
  // In a build tree it is a link to the scripts of the source tree, which messages name.
  std::error_code error;
  append_if_present(environment.scene_folders, fs::canonical(prefix / "share/sim", error));
  return environment;
}

}  // namespace sim
