// Scene files written in Lua 5.4, read once into plain data.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/lua/limits.h"
#include "core/plugin/registry.h"
#include "core/scene/scene_spec.h"

namespace sim {

struct SceneOptions {
  std::vector<std::filesystem::path> search_path;  // folders that hold sim/ and scenes/
  std::map<std::string, std::string> settings{};   // --set name=value
  std::uint64_t seed = 0;                          // of math.random in the scene
  LuaLimits limits = {};
  std::optional<std::string> text = {};  // replaces the contents of the file, which need not exist
  bool safe = false;  // of a stranger: no plugins of its own, no files but below its folder
  std::function<void(const std::string&)> print = {};  // receives printed text; none: stderr
  std::function<bool()> interrupted = {};              // a yes ends Lua with an error
  LuaOverrun overrun = nullptr;                        // told when Lua cannot be ended
};

// Finds `name` as given, then below each folder of the search path. Throws Error{kIo} listing the
// places looked at and the nearest scene that exists.
std::filesystem::path find_scene(const std::string& name,
                                 const std::vector<std::filesystem::path>& search_path);

// Scenes that the search path offers, as they can be given to find_scene ("scenes/cloth.lua").
std::vector<std::string> list_scenes(const std::vector<std::filesystem::path>& search_path);

// Runs the file in a sandbox and checks what it returns. Throws Error{kScene} with FILE:LINE, what
// was expected and the nearest known name; Error{kIo} for a file that cannot be read. Functions in
// the result (fields, exact solutions) keep the Lua state alive.
SceneSpec load_scene(const std::string& name, Registry& registry, const SceneOptions& options);

}  // namespace sim
