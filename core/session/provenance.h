// The origin of a run: the program, the files and the arguments that made it.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/base/input_file.h"

namespace sim {

struct SceneSpec;
class Registry;

struct Provenance {
  std::string program;                           // version and build, as --version says them
  std::vector<InputFile> files;                  // Lua files and plugins
  std::map<std::string, std::string> arguments;  // values of sim.arg, and the seed
  std::string doubt = {};  // changes when the run continued from another checkpoint
};

// The provenance of a scene that was loaded; the registry has opened the plugins of the run.
Provenance provenance_of(const SceneSpec& scene, const Registry& registry, std::uint64_t seed,
                         std::string program);

// A sentence for each change: "module 'wall' (/a/wall.lua)", "argument n: 4, now 5". Only plugins
// of both runs count.
std::vector<std::string> changes(const Provenance& before, const Provenance& now);

}  // namespace sim
