#include "cli/run/scene.h"

#include <algorithm>

#include "cli/terminal/signals.h"
#include "core/base/error.h"
#include "core/lua/scene/scene_file.h"
#include "core/output/format.h"

namespace sim::cli {

bool LoadedScene::has_second_order() const {
  return std::any_of(systems.begin(), systems.end(),
                     [](const Simulation& system) { return system.second_order(); });
}

std::vector<std::string> LoadedScene::names() const {
  std::vector<std::string> names;
  for (const Simulation& system : systems) names.push_back(system.name());
  return names;
}

RunOptions run_options(const SceneRequest& request, const SystemSpec& system, Registry& registry) {
  const MethodChoice& choice = request.integrator;
  return {.integrator = typed(choice, choice.over(system.integrator).name, registry),
          .dt = request.dt,
          .threads = request.threads};
}

LoadedScene load(const SceneRequest& request, const Environment& environment, Registry& registry) {
  // What is wrong on the command line is said before any file is looked at.
  if (!request.integrator.name.empty())
    typed(request.integrator, request.integrator.name, registry);
  LoadedScene scene;
  scene.spec = load_scene(request.scene, registry,
                          {.search_path = environment.scene_folders,
                           .settings = request.settings,
                           .seed = request.seed,
                           .interrupted = SessionSignals::any});
  for (const SystemSpec& system : scene.spec.systems)
    scene.systems.emplace_back(system, registry, run_options(request, system, registry));
  return scene;
}

Error in_step(const Error& error, const Simulation& system) {
  ErrorText text = error.text();
  text.why += " (in step " + std::to_string(system.step_count() + 1) +
              " from t = " + brief(system.t()) + " s)";
  return Error(error.kind(), text);
}

std::string counted(long count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

long spring_count(const Simulation& system) {
  long count = 0;
  for (const auto& [family, springs] : system.families()) count += springs;
  return count;
}

}  // namespace sim::cli
