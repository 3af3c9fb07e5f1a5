// The request behind sim_options, and the scenes that it asks for.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/c/sim.h"
#include "core/lua/environment.h"
#include "core/lua/limits.h"
#include "core/study/budget.h"
#include "core/study/study.h"

namespace sim::c {

// A request for scenes, as given by options.
struct Asked {
  SceneVariant variant;
  Folders folders, libraries;
  Threads threads;
  bool safe = false;
  LuaLimits limits = {};
  std::uint64_t seed = 0;
};

// A required error instead of a step.
struct ChoiceRequest {
  std::optional<study::Budget> error = {};  // nothing: that of the scene
  std::string of = {};                      // a quantity; "": positions
  double time = 0;                          // s, of the run; not above 0: the duration
};

// The request of the options, null being the defaults; smaller ones, of an older header, have
// defaults for what they lack. Throws Error{kUsage} for a wrong size or value.
Asked asked_of(const sim_options* options);

// The environment that is installed with this library, or else the tree that it was built from.
Environment environment_of(const Asked& asked);

// Files that are installed with this library; they need not be there.
std::filesystem::path helper_of_library(const std::string& name);
std::filesystem::path page_of_library();

std::unique_ptr<Registry> registry_of(const Asked& asked, const Environment& environment);

// The scene in this variant; with `text` as the contents of the file `name`. Functions of the scene
// end with an error where `stop` returns true.
StudiedScene load(const std::string& name, const char* text, const Asked& asked,
                  const SceneVariant& variant, Registry& registry,
                  const std::function<bool()>& stop = {});

RunOptions run_options(const SceneVariant& variant, const Asked& asked, const SystemSpec& system,
                       Registry& registry);

}  // namespace sim::c
