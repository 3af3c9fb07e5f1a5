#include "cli/run/environment.h"

#include <cstdlib>
#include <string_view>
#include <utility>

#include "commit.h"
#include "core/base/error.h"
#include "core/plugin/plugin.h"
#include "core/simd/simd_targets.h"

namespace sim::cli {
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

fs::path prefix_of_program() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return program.parent_path().parent_path();
}

// Where the user keeps data, by the XDG base directory specification; empty if there is no home.
fs::path data_home() {
  const char* const data = std::getenv("XDG_DATA_HOME");
  if (data && *data == '/') return data;
  const char* const home = std::getenv("HOME");
  return home && *home ? fs::path(home) / ".local/share" : fs::path();
}

}  // namespace

Environment find_environment(const Folders& plugin_path) {
  const fs::path prefix = prefix_of_program();
  Environment environment;
  environment.plugin_folders = plugin_path;
  append_variable(environment.plugin_folders, "SIM_PLUGIN_PATH");
  if (const fs::path data = data_home(); !data.empty())
    append_if_present(environment.plugin_folders, data / "sim/plugins");
  append_if_present(environment.plugin_folders, prefix / "lib/sim/plugins");
  append_variable(environment.scene_folders, "SIM_PATH");
  // Beside the program if it is installed, otherwise in the source tree.
  const fs::path installed = prefix / "share/sim";
  append_if_present(environment.scene_folders,
                    fs::is_directory(installed) ? installed : fs::path(SIM_SCRIPTS_DIR));
  return environment;
}

Registry open_registry(const Environment& environment, const Folders& libraries, bool probe) {
  if (environment.plugin_folders.empty() && libraries.empty())
    throw Error(ErrorKind::kIo,
                {"no plugin folder", (prefix_of_program() / "lib/sim/plugins").string(),
                 "there is none beside the program", "install it again, or give --plugin-path"});
  return Registry(environment.plugin_folders, libraries, probe);
}

DevelopmentFiles development_files() {
  const fs::path prefix = prefix_of_program();
  std::error_code error;
  const fs::path installed = prefix / "include/sim";
  const fs::path tree = fs::path(SIM_SCRIPTS_DIR).parent_path();
  return {fs::is_directory(installed, error) ? installed : tree, prefix / "lib"};
}

fs::path helper_program(const std::string& name) { return prefix_of_program() / "lib/sim" / name; }

BuildFacts build_facts() { return {SIM_VERSION, SIM_COMMIT, SIM_COMPILER}; }

std::string version_line() {
  const BuildFacts facts = build_facts();
  return "sim " + facts.version + " (commit " + facts.commit + ", " + facts.compiler +
         ", plugin ABI " + std::to_string(kPluginAbi) + ", " + simd_name(simd_level()) + ")";
}

}  // namespace sim::cli
