#include "cli/run/scene.h"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "cli/terminal/console.h"
#include "cli/terminal/signals.h"
#include "core/base/error.h"
#include "core/base/memory.h"
#include "core/base/text.h"
#include "core/lua/scene/scene_file.h"
#include "core/output/format.h"

namespace sim::cli {
namespace {

// What --without may name of a part: its plugin, or the family of springs.
std::vector<std::string> names_of(const PartSpec& part) {
  std::vector<std::string> names{part.plugin};
  if (const auto family = part.given.find("family"); family != part.given.end())
    if (const auto* name = std::get_if<std::string>(&family->second)) names.push_back(*name);
  return names;
}

// Of all systems, or of one of a world: "gravity", "cloth.gravity". Throws Error{kUsage} for a name
// that no part has.
void leave_out(SceneSpec& scene, const std::string& name) {
  std::vector<std::string> known;
  bool found = false;
  for (SystemSpec& system : scene.systems) {
    const std::string before = scene.world ? system.name + "." : "";
    const bool one = scene.world && name.starts_with(before);
    const std::string wanted = one ? name.substr(before.size()) : name;
    for (std::vector<PartSpec>* parts : {&system.forces, &system.colliders})
      std::erase_if(*parts, [&](const PartSpec& part) {
        const std::vector<std::string> names = names_of(part);
        for (const std::string& each : names) {
          known.push_back(each);
          if (scene.world) known.push_back(before + each);
        }
        const bool named = std::ranges::count(names, wanted) > 0;
        found = found || named;
        return named;
      });
  }
  if (found) return;
  std::ranges::sort(known);
  known.erase(std::unique(known.begin(), known.end()), known.end());
  throw Error(ErrorKind::kUsage,
              {"nothing to leave out", "--without " + name,
               "the scene has no force, collider or family of that name", suggestion(name, known)});
}

// In every system that has a switch of this name.
void turn_off(const std::string& name, SceneSpec& scene) {
  bool known = false;
  std::vector<std::string> names;
  for (SystemSpec& system : scene.systems)
    for (std::vector<PartSpec>* parts : {&system.forces, &system.colliders})
      for (PartSpec& part : *parts) {
        if (part.switch_name.empty()) continue;
        names.push_back(part.switch_name);
        if (part.switch_name != name) continue;
        part.on = false;
        known = true;
      }
  if (known) return;
  const std::string remedy = suggestion(name, names);
  throw Error(ErrorKind::kUsage,
              {"no such switch", "--off " + name, "the scene has no switch of this name",
               names.empty() ? "it names them in switches = { NAME = PART }" : remedy});
}

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
  std::vector<std::string> all;
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
  // What is wrong on the command line is said before any file is looked at.
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
  for (const std::string& name : request.without) leave_out(scene.spec, name);
  for (const std::string& name : request.off) turn_off(name, scene.spec);
  for (const SystemSpec& system : scene.spec.systems)
    scene.systems.emplace_back(system, registry, run_options(request, system, registry));
  return scene;
}

void plan_inputs(const SceneSpec& scene, const Registry& registry, FilePlan& plan) {
  for (const InputFile& file : scene.inputs)
    if (file.hash != 0) plan.reads(file.name == "scene" ? "the scene" : "the module", file.path);
  for (const auto& library : registry.libraries()) plan.reads("the plugin", library.string());
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
