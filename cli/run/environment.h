// What surrounds the program: the folders of plugins and scenes, and how it was built.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/plugin/registry.h"

namespace sim::cli {

using Folders = std::vector<std::filesystem::path>;

struct Environment {
  Folders plugin_folders;  // searched in order
  Folders scene_folders;   // each holds sim/ and scenes/
};

// Plugins: `plugin_path` (--plugin-path), then $SIM_PLUGIN_PATH, sim/plugins in $XDG_DATA_HOME (or
// else ~/.local/share), lib/sim/plugins beside the program's bin/. Scenes: $SIM_PATH, then
// share/sim beside bin/, then the scripts of the source tree. The variables hold folders with
// colons between them. Only the built-in folders may be missing.
Environment find_environment(const Folders& plugin_path);

// A registry over these folders, with the libraries of --load opened. Throws Error{kIo} for a
// folder that cannot be read and Error{kPlugin} for a library that cannot be used.
Registry open_registry(const Environment& environment, const Folders& libraries,
                       bool probe = false);

// What a plugin of one's own is compiled and linked with: of the installed program, or else of the
// source tree and its build.
struct DevelopmentFiles {
  std::filesystem::path headers, libraries;
};
DevelopmentFiles development_files();

// A program that serves this one, lib/sim/NAME beside bin/; it need not be there.
std::filesystem::path helper_program(const std::string& name);

struct BuildFacts {
  std::string version, commit, compiler;
};

BuildFacts build_facts();
std::string version_line();  // "sim 0.2.0 (commit .., GNU 12.2.0, plugin ABI 25, avx2)"

}  // namespace sim::cli
