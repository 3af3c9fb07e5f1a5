#include "cli/run/scene.h"

#include <algorithm>
#include <cctype>
#include <string_view>
#include <utility>

#include "cli/terminal/console.h"
#include "cli/terminal/signals.h"
#include "core/base/error.h"
#include "core/base/memory.h"
#include "core/base/text.h"
#include "core/lua/scene/scene_file.h"
#include "core/output/format.h"
#include "core/study/without.h"

namespace sim::cli {
namespace {

std::string shell_word(const std::string& word) {
  const bool plain = !word.empty() && std::ranges::all_of(word, [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) ||
           std::string_view("_-./=,:+@%").find(c) != std::string_view::npos;
  });
  if (plain) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace

std::string command_for(const SceneRequest& request) {
  std::string text = "sim " + shell_word(request.scene);
  for (const auto& [name, value] : request.settings)
    text += " -s " + shell_word(name + "=" + value);
  for (const std::string& name : request.without) text += " --without " + shell_word(name);
  for (const std::string& name : request.off) text += " --off " + shell_word(name);
  if (request.seed != 0) text += " --seed " + std::to_string(request.seed);
  for (const auto& folder : request.plugin_path)
    text += " --plugin-path " + shell_word(folder.string());
  for (const auto& library : request.libraries) text += " --load " + shell_word(library.string());
  return text;
}

SceneVariant variant_of(const SceneRequest& request) {
  return {request.settings, request.off, request.without, request.integrator, request.dt};
}

SceneRequest with_variant(SceneRequest request, const SceneVariant& variant) {
  request.settings = variant.settings;
  request.off = variant.off;
  request.without = variant.without;
  request.integrator = variant.integrator;
  request.dt = variant.dt;
  return request;
}

report::NamedScene named_scene(const SceneRequest& request) {
  return {variant_of(request), request.scene, request.seed};
}

SceneRequest with_scene(SceneRequest request, const report::NamedScene& named) {
  request.scene = named.scene;
  request.seed = named.seed;
  return with_variant(std::move(request), named);
}

bool LoadedScene::has_second_order() const {
  return std::any_of(systems.begin(), systems.end(),
                     [](const Simulation& system) { return system.second_order(); });
}

int LoadedScene::threads() const {
  int most = 1;
  for (const Simulation& system : systems) most = std::max(most, system.threads());
  return most;
}

std::vector<std::string> LoadedScene::names() const {
  std::vector<std::string> names;
  for (const Simulation& system : systems) names.push_back(system.name());
  return names;
}

std::vector<std::string> LoadedScene::notes() {
  std::vector<std::string> all = spec.notes;
  for (Simulation& system : systems)
    for (const auto& notes : {system.integrator().notes(), system.ode().notes()})
      for (const std::string& note : notes)
        if (std::ranges::find(all, note) == all.end()) all.push_back(note);
  return all;
}

RunOptions run_options(const SceneRequest& request, const SystemSpec& system, Registry& registry) {
  const MethodChoice& choice = request.integrator;
  return {.integrator = typed(choice, choice.over(system.integrator).name, registry),
          .dt = request.dt,
          .threads = request.threads};
}

LoadedScene load(const SceneRequest& request, const Environment& environment, Registry& registry) {
  // Errors of the command line are reported before any file is read.
  if (!request.integrator.name.empty())
    typed(request.integrator, request.integrator.name, registry);
  constexpr double kSafeMemory = 4e9;  // bytes
  if (request.safe) limit_memory(kSafeMemory);
  LoadedScene scene;
  scene.registry = &registry;
  scene.spec = load_scene(request.scene, registry,
                          {.search_path = environment.scene_folders,
                           .settings = request.settings,
                           .seed = request.seed,
                           .limits = request.lua,
                           .safe = request.safe,
                           .interrupted = SessionSignals::any,
                           .overrun = end_overrun});
  for (const std::string& name : request.without) study::leave_out(name, scene.spec);
  for (const std::string& name : request.off) study::turn_off(name, scene.spec);
  for (const SystemSpec& system : scene.spec.systems)
    scene.systems.emplace_back(system, registry, run_options(request, system, registry));
  return scene;
}

Error in_step(const Error& error, const Simulation& system) {
  ErrorText text = error.text();
  const std::string named = " (in step ";
  if (text.why.find(named) != std::string::npos) return error;
  text.why +=
      named + std::to_string(system.step_count() + 1) + " from t = " + brief(system.t()) + " s)";
  return Error(error.kind(), text);
}

}  // namespace sim::cli
