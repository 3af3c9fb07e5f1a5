// Checkpoints: files from which scenes go on bit for bit.
#include <iostream>

#include "commit.h"
#include "core/c/handles.h"
#include "core/engine/engine_run.h"
#include "core/lua/scene/scene_file.h"
#include "core/report/checkpoint_file.h"

using namespace sim;
using namespace sim::c;

namespace sim::c {

report::CheckpointOrigin origin_of(const sim_scene& scene) {
  return {scene.name, scene.asked.variant.settings, scene.asked.seed,
          report::program_line(SIM_VERSION, SIM_COMMIT, SIM_COMPILER)};
}

std::vector<report::Account> accounts_now(const sim_scene& scene) {
  if (scene.accounts_at == scene.generation) return scene.accounts;
  std::vector<report::Account> accounts;
  for (const Simulation& system : scene.loaded.systems)
    accounts.push_back({system.second_order() ? system.energy().total() : 0, {}});
  return accounts;
}

report::NamedScene named_scene(const sim_scene& scene) {
  return {scene.asked.variant, scene.name, scene.asked.seed};
}

std::string checked_file(const char* file, const std::string& what) {
  std::string name = checked_text(file, "file");
  if (name.empty() || name == "-" || is_stream(name))
    refuse("no file for " + what, "file '" + name + "'", "it is no regular file",
           "give the name of one");
  return name;
}

FilePlan plan_of(const sim_scene& scene) {
  FilePlan plan;
  plan_inputs(scene.loaded.spec, *scene.registry, plan);
  return plan;
}

}  // namespace sim::c

namespace {

void resume_scene(sim_scene& scene, const Checkpoint& saved, const std::string& file) {
  ++scene.generation;
  scene.verdicts.clear();
  scene.choices.clear();
  scene.accounts = report::resume_all(scene.loaded, origin_of(scene), saved, file, *scene.registry);
  scene.accounts_at = scene.generation;
  scene.resumed = true;
}

}  // namespace

extern "C" {

int sim_save(const sim_scene* scene, const char* file, sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    const std::string name = checked_file(file, "a checkpoint");
    FilePlan plan = plan_of(*scene);
    plan.writes("the checkpoint", name);
    plan.check();
    report::make_checkpoint(name, origin_of(*scene), scene->loaded, *scene->registry,
                            accounts_now(*scene), std::cout)
        ->commit_safely();
  });
}

int sim_resume(sim_scene* scene, const char* file, sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    refuse_in_record(*scene, "resume");
    const std::string name = checked_text(file, "file");
    resume_scene(*scene, report::read_checkpoint(name), name);
  });
}

sim_scene* sim_open_saved(const char* file, const sim_options* options, sim_error* error) {
  return sim_open_saved_watched(file, options, nullptr, nullptr, error);
}

sim_scene* sim_open_saved_watched(const char* file, const sim_options* options, sim_watch watch,
                                  void* user, sim_error* error) {
  return guarded_pointer(error, [&] {
    std::string name = checked_text(file, "file");
    Asked asked = asked_of(options);
    // The start of an export, whose notes say which parts were left out.
    if (std::error_code failed; std::filesystem::is_directory(name, failed)) {
      const auto registry = registry_of(asked, environment_of(asked));
      const engine::EngineNotes notes = engine::read_engine_notes(name, *registry);
      if (asked.variant.without.empty()) asked.variant.without = notes.without;
      name += std::string("/") + engine::kEngineStart;
    }
    const Checkpoint saved = report::read_checkpoint(name);
    asked.variant.settings.insert(saved.settings.begin(), saved.settings.end());
    if (asked.seed == 0) asked.seed = saved.seed;
    Watcher watcher(watch, user);
    std::unique_ptr<sim_scene> scene = opened(saved.scene, nullptr, asked, watcher);
    resume_scene(*scene, saved, name);
    return scene.release();
  });
}

}  // extern "C"
