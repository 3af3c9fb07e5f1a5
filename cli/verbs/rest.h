// The rest state of a scene: `sim rest SCENE` and --from-rest.
#pragma once

#include <optional>

#include "cli/run/scene.h"
#include "cli/terminal/console.h"
#include "core/output/output.h"
#include "core/study/rest.h"

namespace sim::cli {

struct RestRequest {
  SceneRequest scene;
  std::optional<Target> dump;
  bool json = false, quiet = false;
};

// Brings every system to rest and reports it, one line each. Throws Error{kDiverged} if there is no
// rest state.
void bring_to_rest(LoadedScene& scene, std::ostream* words);

int rest(const RestRequest& request, const Environment& environment, Registry& registry,
         Console& console);

}  // namespace sim::cli
