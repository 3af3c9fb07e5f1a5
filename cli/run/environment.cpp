#include "cli/run/environment.h"

#include <utility>

#include "commit.h"
#include "core/base/error.h"
#include "core/report/checkpoint_file.h"

namespace sim::cli {
namespace {

namespace fs = std::filesystem;

fs::path prefix_of_program() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return program.parent_path().parent_path();
}

}  // namespace

Environment find_environment(const Folders& plugin_path) {
  return sim::find_environment(prefix_of_program(), plugin_path);
}

Registry open_registry(const Environment& environment, const Folders& libraries, bool probe) {
  if (environment.plugin_folders.empty() && libraries.empty() && linked_plugins().empty())
    throw Error(ErrorKind::kIo,
                {"no plugin folder", (library_folder(prefix_of_program()) / "plugins").string(),
                 "there is none beside the program", "install it again, or give --plugin-path"});
  return Registry(environment.plugin_folders, libraries, probe, linked_plugins());
}

DevelopmentFiles development_files() {
  const fs::path prefix = prefix_of_program();
  return {prefix / "include/sim", library_folder(prefix)};
}

fs::path helper_file(const std::string& name) { return library_folder(prefix_of_program()) / name; }

fs::path page_with_kernel() { return sim::page_with_kernel(prefix_of_program()); }

fs::path editor_types() { return library_folder(prefix_of_program()) / "luacats/sim.lua"; }

BuildFacts build_facts() { return {SIM_VERSION, SIM_COMMIT, SIM_COMPILER}; }

std::string version_line() {
  const BuildFacts facts = build_facts();
  return report::program_line(facts.version, facts.commit, facts.compiler);
}

}  // namespace sim::cli
