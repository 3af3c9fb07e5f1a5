// The folders in which plugins and scenes are found.
#pragma once

#include <filesystem>
#include <vector>

namespace sim {

using Folders = std::vector<std::filesystem::path>;

struct Environment {
  Folders plugin_folders;  // searched in order
  Folders scene_folders;   // each holds sim/ and scenes/
};

// The environment installed below `prefix`. Plugins: `plugin_path` (--plugin-path), then
// $SIM_PLUGIN_PATH, sim/plugins in $XDG_DATA_HOME (or else ~/.local/share), lib/sim/plugins below
// the prefix. Scenes: $SIM_PATH, then share/sim below the prefix. The variables hold folders with
// colons between them. Only the built-in folders may be missing.
Environment find_environment(const std::filesystem::path& prefix, const Folders& plugin_path);

// The page that ./dev web made, for exports; it need not be there.
std::filesystem::path page_with_kernel(const std::filesystem::path& prefix);

// The folder of the libraries that are part of sim, and of plugins/: lib/sim, where the build was
// given no other name for lib.
std::filesystem::path library_folder(const std::filesystem::path& prefix);

}  // namespace sim
