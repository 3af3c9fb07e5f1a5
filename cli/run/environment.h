// The environment of the program: the folders of plugins and scenes, and how it was built.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/lua/environment.h"
#include "core/plugin/registry.h"

namespace sim::cli {

using sim::Environment, sim::Folders;

// The folders of the installation, or of the build, that the program is a part of.
Environment find_environment(const Folders& plugin_path);

// A registry over these folders, with the libraries of --load opened. Throws Error{kIo} for a
// folder that cannot be read and Error{kPlugin} for a library that cannot be used.
Registry open_registry(const Environment& environment, const Folders& libraries,
                       bool probe = false);

// The files that a user's plugin is compiled and linked with.
struct DevelopmentFiles {
  std::filesystem::path headers, libraries;
};
DevelopmentFiles development_files();

// A program or library that serves this one, lib/sim/NAME below the prefix; it need not be there.
std::filesystem::path helper_file(const std::string& name);

// The page that ./dev web made, for `sim export --format page`; it need not be there.
std::filesystem::path page_with_kernel();

// The file of types of the scene language for editors; the build makes it.
std::filesystem::path editor_types();

struct BuildFacts {
  std::string version, commit, compiler;
};

BuildFacts build_facts();
std::string version_line();  // "sim 0.2.0 (commit .., GNU 12.2.0, plugin ABI 25, avx2)"

}  // namespace sim::cli
