// Recordings: changes of a scene as text, and runs that repeat them.
#include <algorithm>

#include "core/c/handles.h"
#include "core/c/run.h"
#include "core/report/replays.h"

using namespace sim;
using namespace sim::c;

namespace sim::c {

SceneRecord::SceneRecord(const sim_scene& scene, const std::string& file)
    : scene_(scene),
      file_(file, [this](const std::string& why) { failure_ = why; }),
      writer_([this](std::string_view lines) { file_.append(lines); },
              report::recording_header(named_scene(scene)), scene.loaded.spec.world) {
  file_.begin();
}

SceneRecord::~SceneRecord() {
  try {
    finish();
  } catch (...) {  // nobody is left to be told
  }
}

std::string SceneRecord::name_of(std::size_t system) const {
  return scene_.loaded.spec.world ? scene_.loaded.systems[system].name() : "";
}

void SceneRecord::action(std::size_t system, const Action& action) {
  writer_.action(name_of(system), scene_.loaded.systems[system].step_count(), action);
}

void SceneRecord::reset() {
  for (std::size_t i = 0; i < scene_.loaded.systems.size(); ++i)
    writer_.reset(name_of(i), scene_.loaded.systems[i].step_count());
}

void SceneRecord::finish() {
  if (std::exchange(finished_, true)) return;
  for (std::size_t i = 0; i < scene_.loaded.systems.size(); ++i) {
    const Simulation& system = scene_.loaded.systems[i];
    writer_.end(name_of(i), system.step_count(), system.hash());
  }
  if (file_.finish() != 0)
    throw Error(ErrorKind::kIo, {"the recording is not whole", "the file", failure_,
                                 "make room there, and record again"});
}

void refuse_in_record(const sim_scene& scene, const char* what) {
  if (scene.record)
    refuse("not in a recording", what, "a recording has steps and changes only",
           "end it before: sim_record_end()");
}

}  // namespace sim::c

namespace {

void check_start(const sim_scene& scene) {
  if (scene.generation != 1)
    refuse("not at its start", "scene",
           "a recording begins with the state of the scene, which was stepped or changed since",
           "open it again");
}

std::unique_ptr<sim_scene> opened_recorded(const std::string& file, const sim_options* options,
                                           Watcher& watcher) {
  Asked asked = asked_of(options);
  report::NamedScene named{asked.variant, "", asked.seed};
  report::Replays(file).complete(named);
  asked.variant = named;
  asked.seed = named.seed;
  return opened(named.scene, nullptr, asked, watcher);
}

void replay(sim_scene& scene, const std::string& file, int verify, Watcher& watcher) {
  check_start(scene);
  refuse_in_record(scene, "replay");
  report::Replays replays(file);
  replays.compare_with(named_scene(scene));
  replays.begin(scene.loaded, *scene.registry);
  run(scene, {.verify = verify, .replays = &replays}, watcher);
  const auto diverged = [](const study::Verdict& verdict) {
    return verdict.trust == study::Trust::kDiverged;
  };
  if (!watcher.told() && std::ranges::none_of(scene.verdicts, diverged))
    replays.compare(scene.loaded);
}

}  // namespace

extern "C" {

int sim_record(sim_scene* scene, const char* file, sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    const std::string name = checked_file(file, "a recording");
    check_start(*scene);
    refuse_in_record(*scene, "record");
    if (!scene->from_file)
      refuse("no file of a scene", scene->name, "a recording names the file of its scene",
             "write the text to a file, and open that");
    if (asks_for_error(*scene, false))
      refuse("a step by trials", scene->name,
             "it asks for an error, and a recording names a method and a step",
             "open it with an integrator and its tol");
    FilePlan plan = plan_of(*scene);
    plan.writes("the recording", name);
    plan.check();
    scene->record = std::make_unique<SceneRecord>(*scene, name);
  });
}

int sim_record_end(sim_scene* scene, sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    if (!scene->record)
      refuse("no recording", "scene", "none was begun, or it has ended", "call sim_record() first");
    const std::unique_ptr<SceneRecord> record = std::move(scene->record);
    record->finish();
  });
}

sim_scene* sim_open_recorded(const char* file, const sim_options* options, sim_watch watch,
                             void* user, sim_error* error) {
  return guarded_pointer(error, [&] {
    Watcher watcher(watch, user);
    return opened_recorded(checked_text(file, "file"), options, watcher).release();
  });
}

int sim_replay(sim_scene* scene, const char* file, int verify, sim_watch watch, void* user,
               sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    const std::string name = checked_text(file, "file");
    check_verify(verify);
    Watcher watcher(watch, user);
    stoppable_by(watcher,
                 [&] { stoppable(*scene, [&] { replay(*scene, name, verify, watcher); }); });
    if (watcher.told()) throw Stopped();
  });
}

}  // extern "C"
