// A scene from its file to systems that can be stepped, shared by the verbs.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "cli/command_line/integrator_choice.h"
#include "cli/run/environment.h"
#include "cli/run/judged.h"
#include "core/base/error.h"
#include "core/lua/limits.h"
#include "core/output/file_plan.h"
#include "core/report/replays.h"
#include "core/report/study_words.h"
#include "core/report/summary.h"
#include "core/scene/simulation.h"
#include "core/study/study.h"

namespace sim::cli {

using report::counted, report::spring_count;

inline constexpr std::int64_t kMostThreads = 1024;

struct SceneRequest {
  std::string scene = "scenes/cloth.lua";
  std::map<std::string, std::string> settings{};  // --set
  std::vector<std::string> off{};                 // --off: switches
  std::vector<std::string> without{};             // --without
  std::uint64_t seed = 0;
  MethodChoice integrator{};
  double dt = 0;  // s; 0 = the scene's own
  Threads threads{};
  LuaLimits lua = {};
  bool safe = false;  // --safe
  // --plugin-path and --load: the registry has them, and printed commands repeat them.
  Folders plugin_path = {}, libraries = {};
};

// The part of a request that studies change, and a request with that part.
SceneVariant variant_of(const SceneRequest& request);
SceneRequest with_variant(SceneRequest request, const SceneVariant& variant);

// The part of a request that recordings and pages tell, and a request with that part.
report::NamedScene named_scene(const SceneRequest& request);
SceneRequest with_scene(SceneRequest request, const report::NamedScene& named);

// The same for one system, as Simulation takes it. Throws Error{kUsage} for an unknown integrator
// or bad values.
RunOptions run_options(const SceneRequest& request, const SystemSpec& system, Registry& registry);

struct LoadedScene : StudiedScene {
  const Registry* registry = nullptr;

  bool has_second_order() const;
  int threads() const;  // that steps run on now: the most of all systems
  std::vector<std::string> names() const;
  std::vector<std::string> notes();  // of the scene, its integrators and systems; each once
};

// Throws Error: kUsage for an unknown integrator of the command line or bad values, else the errors
// of load_scene and Simulation.
LoadedScene load(const SceneRequest& request, const Environment& environment, Registry& registry);

// "sim SCENE -s n=3 --without drag": the words of a command that loads it, quoted for a shell.
std::string command_for(const SceneRequest& request);

// The error of a right-hand side written in Lua, with the step it failed in; that of a plugin names
// it already.
Error in_step(const Error& error, const Simulation& system);

}  // namespace sim::cli
