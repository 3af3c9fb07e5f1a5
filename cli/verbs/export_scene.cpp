#include "cli/verbs/export_scene.h"

#include <filesystem>

#include "cli/run/run_length.h"
#include "core/base/error.h"
#include "core/engine/lammps_input.h"
#include "core/output/format.h"

namespace sim::cli {
namespace {

namespace fs = std::filesystem;

void make_folder(const std::string& folder) {
  std::error_code failed;
  fs::create_directory(folder, failed);
  if (!fs::is_directory(folder))
    throw Error(ErrorKind::kIo, {"cannot make a folder", folder,
                                 failed ? failed.message() : "it is a file", "give another name"});
  if (fs::exists(fs::path(folder) / engine::kLammpsFrames))
    throw Error(ErrorKind::kIo,
                {"results would be lost", folder,
                 std::string("it holds ") + engine::kLammpsFrames + " of an earlier export",
                 "sim import it, then give another folder or remove it"});
}

// From where the folder is read, the scene is found again.
SceneRequest findable(SceneRequest request) {
  std::error_code failed;
  if (fs::exists(request.scene, failed)) request.scene = fs::absolute(request.scene).string();
  return request;
}

}  // namespace

int export_scene(const RunRequest& request, LoadedScene& scene, const Account* account,
                 Console& console) {
  Simulation& system = scene.systems.front();
  const engine::Exchange exchange(system, scene.spec.systems.front());
  const RunLength length{request.time, request.steps};
  const std::int64_t steps = steps_of(length, system);
  const std::int64_t tenth = std::max<std::int64_t>(1, (steps + 9) / 10);
  const std::int64_t every = request.every.value_or(tenth);
  Track track(scene.spec.systems.front(), system, steps, every, tenth);
  shorten(length, track);
  if (account) track.continue_from(account->start_energy, account->work);
  const std::int64_t strides[] = {every, tenth};
  const std::vector<std::int64_t> moments = moments_of(track, strides, 0, nullptr);

  const std::string& folder = request.export_to;
  make_folder(folder);
  EngineNotes notes;
  if (request.steps)
    notes.steps = request.steps;
  else
    notes.time = request.time.value_or(system.duration());
  notes.every = every;
  notes.without = request.scene.without;
  write_engine_notes(notes, folder);
  const Account start{track.start_energy().total(), track.work_memory()};
  save_checkpoint(folder + "/" + kEngineStart, findable(request.scene), scene, {&start, 1},
                  console.out);
  engine::write_lammps(exchange, moments, folder);

  const std::int64_t last = moments.back();
  const double bytes = 8.0 * engine::kLammpsColumns * system.particles();
  std::string text;
  if (request.json)
    text = JsonObject()
               .text("folder", folder)
               .integer("particles", system.particles())
               .integer("springs", spring_count(system))
               .integer("steps", last - moments.front())
               .integer("frames", static_cast<std::int64_t>(moments.size()))
               .str() +
           '\n';
  else if (!request.quiet)
    text =
        label("wrote", folder) + label("particles", std::to_string(system.particles())) +
        label("springs", std::to_string(spring_count(system))) +
        label("steps", std::to_string(last - moments.front()) + " of " + brief(system.h()) +
                           " s, " + system.method().name()) +
        label("frames", std::to_string(moments.size()) + ", " +
                            brief(1e-6 * bytes * static_cast<double>(moments.size()), 3) + " MB") +
        label("run", "cd " + folder + "; mpirun -np 4 lmp -in " + engine::kLammpsScript) +
        label("then", "sim import " + folder + " --dump=run.csv");
  put(console.out, text);
  flush_or_throw(console.out, "standard output");
  return 0;
}

int export_state(const RunRequest& request, LoadedScene& scene, std::span<const Account> accounts,
                 Registry& registry, Console& console) {
  OutRequest out;
  out.files = {request.export_to};
  Recorder recorder(out, scene, registry);
  long particles = 0, springs = 0;
  for (std::size_t i = 0; i < scene.systems.size(); ++i) {
    Simulation& system = scene.systems[i];
    Track track(scene.spec.systems[i], system, system.step_count(), Track::kNever, Track::kNever);
    if (!accounts.empty()) track.continue_from(accounts[i].start_energy, accounts[i].work);
    recorder.look(i, track, true);
    particles += system.particles();
    springs += spring_count(system);
  }
  recorder.commit({});
  std::string text;
  if (request.json)
    text = JsonObject()
               .text("file", request.export_to)
               .integer("particles", particles)
               .integer("springs", springs)
               .str() +
           '\n';
  else if (!request.quiet)
    text = label("wrote", request.export_to) + label("particles", std::to_string(particles)) +
           label("springs", std::to_string(springs));
  put(console.out, text);
  flush_or_throw(console.out, "standard output");
  return 0;
}

void complete_import(RunRequest& request, const Checkpoint& saved) {
  const EngineNotes notes = read_engine_notes(request.engine->results);
  request.scene.scene = saved.scene;
  if (request.scene.without.empty()) request.scene.without = notes.without;
  if (!request.time && !request.steps) {
    request.time = notes.time;
    request.steps = notes.steps;
  }
  if (!request.every) request.every = notes.every;
}

}  // namespace sim::cli
