// Steps, and their end from outside.
#include "core/c/handles.h"
#include "core/c/watcher.h"
#include "core/study/run/divergence_text.h"

using namespace sim;
using namespace sim::c;

namespace {

// One step at a time where the scene's own functions may fail in it: it stays where it was.
int steps_of_scene(Simulation& system, std::int64_t most, bool calls_scene) {
  if (!calls_scene) return system.steps(most);
  const Snapshot before = system.snapshot();
  try {
    return system.steps(1);
  } catch (...) {
    system.restore(before);
    throw;
  }
}

[[noreturn]] void tell_divergence(const SystemSpec& spec, Simulation& system) {
  throw Error(ErrorKind::kDiverged,
              {"diverged", system.name(), study::divergence_text(spec, system),
               "try a smaller dt or another integrator"});
}

// Up to `most` steps; 0 where they were given up.
int some_steps(sim_scene& scene, std::size_t i, std::int64_t most) {
  Simulation& system = scene.loaded.systems[i];
  const SystemSpec& spec = scene.loaded.spec.systems[i];
  try {
    const int taken = steps_of_scene(system, most, spec.one_thread);
    if (taken > 0 || system.divergence().status == StepStatus::kStopped) return taken;
  } catch (const Error&) {
    if (!scene.stop->asked()) throw;  // or a function of the scene was ended
    return 0;
  }
  tell_divergence(spec, system);
}

// One step of each system of a world; false where one was given up. Where one is not taken none is.
bool step_of_all(sim_scene& scene) {
  std::vector<Snapshot> before;
  const auto put_back = [&] {
    for (std::size_t i = 0; i < before.size(); ++i) scene.loaded.systems[i].restore(before[i]);
  };
  for (std::size_t i = 0; i < scene.loaded.systems.size(); ++i) {
    before.push_back(scene.loaded.systems[i].snapshot());
    try {
      if (some_steps(scene, i, 1) > 0) continue;
    } catch (...) {
      put_back();
      throw;
    }
    put_back();
    return false;
  }
  return true;
}

// So many steps of each system, or fewer where scene.stop says so; done: of each.
void take_steps(sim_scene& scene, std::int64_t steps, std::int64_t& done) {
  const bool alone = scene.loaded.systems.size() == 1;
  while (done < steps && !scene.stop->asked()) {
    const int more = alone ? some_steps(scene, 0, steps - done) : step_of_all(scene);
    if (more == 0) break;
    done += more;
  }
}

// System after system: nobody ends them.
void take_all_steps(sim_scene& scene, std::int64_t steps, std::int64_t* taken) {
  for (std::size_t i = 0; i < scene.loaded.systems.size(); ++i)
    for (std::int64_t done = 0; done < steps;) {
      done += some_steps(scene, i, steps - done);
      if (taken) *taken = done;
    }
}

}  // namespace

extern "C" {

int sim_step(sim_scene* scene, int64_t steps, int64_t* taken, sim_error* error) {
  if (taken) *taken = 0;
  return guarded(error, [&] {
    const InCall call(scene);
    if (steps < 0) refuse("bad value", "steps", "it is below 0", "give a count");
    ++scene->generation;
    stoppable(*scene, [&] { take_all_steps(*scene, steps, taken); });
  });
}

int sim_step_watched(sim_scene* scene, int64_t steps, int64_t* taken, sim_watch watch, void* user,
                     sim_error* error) {
  if (taken) *taken = 0;
  return guarded(error, [&] {
    const InCall call(scene);
    if (steps < 0) refuse("bad value", "steps", "it is below 0", "give a count");
    ++scene->generation;
    Watcher watcher(watch, user, Watcher::First::kLater);
    std::int64_t own = 0, &done = taken ? *taken : own;
    const Stop::By asked(*scene->stop, [&] {
      return watcher.stopped("steps", steps > 0 ? static_cast<double>(done) / steps : 1);
    });
    stoppable(*scene, [&] { take_steps(*scene, steps, done); });
    if (watcher.told()) throw Stopped();
  });
}

int sim_step_for(sim_scene* scene, int64_t steps, double seconds, int64_t* taken,
                 sim_error* error) {
  if (taken) *taken = 0;
  return guarded(error, [&] {
    const InCall call(scene);
    if (steps < 0) refuse("bad value", "steps", "it is below 0", "give a count");
    if (!(seconds >= 0)) refuse("bad value", "seconds", "it is below 0", "give a time in s");
    ++scene->generation;
    const double begin = coarse_now();
    std::int64_t own = 0, &done = taken ? *taken : own;
    const Stop::By asked(*scene->stop, [&] { return coarse_now() - begin > seconds; });
    stoppable(*scene, [&] { take_steps(*scene, steps, done); });
    if (done < steps) throw Stopped();
  });
}

}  // extern "C"
