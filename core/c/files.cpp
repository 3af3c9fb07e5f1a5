// Checkpoints: files from which scenes go on bit for bit.
#include <iostream>

#include "commit.h"
#include "core/c/handles.h"
#include "core/lua/scene/scene_file.h"
#include "core/output/file_plan.h"
#include "core/report/checkpoint_file.h"

using namespace sim;
using namespace sim::c;

namespace {

report::CheckpointOrigin origin_of(const sim_scene& scene) {
  return {scene.name, scene.asked.variant.settings, scene.asked.seed,
          report::program_line(SIM_VERSION, SIM_COMMIT, SIM_COMPILER)};
}

// The books of the last run, or of the checkpoint, where these are of the present state.
std::vector<report::Account> accounts_now(const sim_scene& scene) {
  if (scene.accounts_at == scene.generation) return scene.accounts;
  std::vector<report::Account> accounts;
  for (const Simulation& system : scene.loaded.systems)
    accounts.push_back({system.second_order() ? system.energy().total() : 0, {}});
  return accounts;
}

void resume(sim_scene& scene, const Checkpoint& saved, const std::string& file) {
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
    const std::string name = checked_text(file, "file");
    if (name.empty() || name == "-" || is_stream(name))
      refuse("no file for a checkpoint", "file '" + name + "'", "it is no regular file",
             "give the name of one");
    FilePlan plan;
    plan_inputs(scene->loaded.spec, *scene->registry, plan);
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
    const std::string name = checked_text(file, "file");
    resume(*scene, report::read_checkpoint(name), name);
  });
}

sim_scene* sim_open_saved(const char* file, const sim_options* options, sim_error* error) {
  return guarded_pointer(error, [&] {
    const std::string name = checked_text(file, "file");
    const Checkpoint saved = report::read_checkpoint(name);
    Asked asked = asked_of(options);
    asked.variant.settings.insert(saved.settings.begin(), saved.settings.end());
    if (asked.seed == 0) asked.seed = saved.seed;
    std::unique_ptr<sim_scene> scene = opened(saved.scene, nullptr, asked);
    resume(*scene, saved, name);
    return scene.release();
  });
}

}  // extern "C"
