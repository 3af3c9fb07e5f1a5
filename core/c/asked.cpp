#include "core/c/asked.h"

#include <dlfcn.h>

#include <cmath>
#include <cstring>

#include "core/base/text.h"
#include "core/c/handles.h"
#include "core/lua/scene/scene_file.h"
#include "core/study/method_text.h"
#include "core/study/without.h"

namespace sim::c {
namespace {

constexpr int kMostThreads = 1024;

// Below which bin/, lib/ and share/ lie.
std::filesystem::path prefix_of_library() {
  Dl_info info{};
  if (!dladdr(reinterpret_cast<const void*>(&sim_interface_version), &info) || !info.dli_fname)
    return {};
  std::error_code failed;
  const std::filesystem::path file = std::filesystem::canonical(info.dli_fname, failed);
  const std::filesystem::path folder = file.parent_path();
  // lib/, or lib/x86_64-linux-gnu/.
  return folder.filename() == "lib" ? folder.parent_path() : folder.parent_path().parent_path();
}

std::vector<std::string> list_of(const char* const* texts) {
  std::vector<std::string> list;
  for (; texts && *texts; ++texts) list.emplace_back(*texts);
  return list;
}

std::map<std::string, std::string> settings_of(const char* const* texts) {
  std::map<std::string, std::string> settings;
  for (const std::string& text : list_of(texts)) {
    const std::size_t equals = text.find('=');
    if (equals == 0 || equals == std::string::npos)
      refuse("bad setting", "settings '" + text + "'", "it is not NAME=VALUE",
             "write it like n=32");
    settings[text.substr(0, equals)] = text.substr(equals + 1);
  }
  return settings;
}

}  // namespace

Asked asked_of(const sim_options* given) {
  Asked asked;
  if (!given) return asked;
  const sim_options copy = whole_of<sim_options>(*given, "SIM_OPTIONS"), *const options = &copy;
  asked.variant.settings = settings_of(options->settings);
  asked.variant.off = list_of(options->off);
  asked.variant.without = list_of(options->without);
  if (options->integrator) asked.variant.integrator = study::parse_integrator(options->integrator);
  if (!(options->dt >= 0 && options->dt < HUGE_VAL))
    refuse("bad value", "dt " + brief(options->dt), "it must be above 0, or 0 for the scene's own",
           "give it in s, like 0.005");
  asked.variant.dt = options->dt;
  for (const std::string& folder : list_of(options->folders)) asked.folders.emplace_back(folder);
  for (const std::string& file : list_of(options->libraries)) asked.libraries.emplace_back(file);
  if (options->threads < 0 || options->threads > kMostThreads)
    refuse("bad value", "threads " + std::to_string(options->threads), "it is not 1 .. 1024",
           "give the number of cores at most");
  asked.threads = Threads(std::max(1, options->threads));
  asked.safe = options->safe != 0;
  asked.seed = options->seed;
  if (asked.safe) asked.limits = safe_limits();
  if (options->lua_budget) {
    asked.limits.steps_in_all = true;
    asked.limits = with_budget(asked.limits, "lua_budget", options->lua_budget);
  }
  return asked;
}

Environment environment_of(const Asked& asked) {
  return find_environment(prefix_of_library(), asked.folders);
}

std::filesystem::path helper_of_library(const std::string& name) {
  return library_folder(prefix_of_library()) / name;
}

std::filesystem::path page_of_library() { return page_with_kernel(prefix_of_library()); }

std::unique_ptr<Registry> registry_of(const Asked& asked, const Environment& environment) {
  if (environment.plugin_folders.empty() && asked.libraries.empty() && linked_plugins().empty())
    throw Error(ErrorKind::kIo,
                {"no plugin folder", (library_folder(prefix_of_library()) / "plugins").string(),
                 "there is none beside the library", "install it again, or name one in folders"});
  return std::make_unique<Registry>(environment.plugin_folders, asked.libraries, false,
                                    linked_plugins());
}

RunOptions run_options(const SceneVariant& variant, const Asked& asked, const SystemSpec& system,
                       Registry& registry) {
  const MethodChoice& choice = variant.integrator;
  return {.integrator = study::typed(choice, choice.over(system.integrator).name, registry),
          .dt = variant.dt,
          .threads = asked.threads};
}

StudiedScene load(const std::string& name, const char* text, const Asked& asked,
                  const SceneVariant& variant, Registry& registry,
                  const std::function<bool()>& stop) {
  if (!variant.integrator.name.empty())
    study::typed(variant.integrator, variant.integrator.name, registry);
  SceneOptions options{.search_path = environment_of(asked).scene_folders,
                       .settings = variant.settings,
                       .seed = asked.seed,
                       .limits = asked.limits,
                       .safe = asked.safe,
                       .interrupted = stop};
  if (text) options.text = text;
  StudiedScene scene;
  scene.spec = load_scene(name, registry, options);
  for (const std::string& part : variant.without) study::leave_out(part, scene.spec);
  for (const std::string& part : variant.off) study::turn_off(part, scene.spec);
  for (const SystemSpec& system : scene.spec.systems) {
    if (stop && stop()) throw Stopped();
    scene.systems.emplace_back(system, registry, run_options(variant, asked, system, registry));
  }
  return scene;
}

}  // namespace sim::c
