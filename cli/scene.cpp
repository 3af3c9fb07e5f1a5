#include "cli/scene.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/lua/scene_file.h"

namespace sim::cli {
namespace {

// The same words as for a scene, but it is the command line that is wrong.
void check_integrator(const std::string& name, Registry& registry) {
  try {
    registry.integrator(name);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::kScene) throw;
    ErrorText text = error.text();
    text.where = "on the command line";
    throw Error(ErrorKind::kUsage, text);
  }
}

}  // namespace

bool LoadedScene::has_second_order() const {
  return std::any_of(systems.begin(), systems.end(),
                     [](const Simulation& system) { return system.second_order(); });
}

std::vector<std::string> LoadedScene::names() const {
  std::vector<std::string> names;
  for (const Simulation& system : systems) names.push_back(system.name());
  return names;
}

LoadedScene load(const SceneRequest& request, const Environment& environment, Registry& registry) {
  if (!request.options.integrator.empty()) check_integrator(request.options.integrator, registry);
  LoadedScene scene;
  scene.spec = load_scene(request.scene, registry,
                          {environment.scene_folders, request.settings, request.seed});
  for (const SystemSpec& system : scene.spec.systems)
    scene.systems.emplace_back(system, registry, request.options);
  return scene;
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
