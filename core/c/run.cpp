// Judged runs.
#include <chrono>
#include <cmath>
#include <cstring>

#include "core/c/choice.h"
#include "core/c/handles.h"
#include "core/c/watcher.h"
#include "core/report/goal_report.h"
#include "core/report/summary.h"
#include "core/study/run/follow.h"
#include "core/study/run/run_length.h"
#include "core/study/run/verification.h"

using namespace sim;
using namespace sim::c;

namespace {

using study::Track;

// While it exists, long steps ask the watcher.
class Watched {
 public:
  Watched(std::vector<Simulation>& systems, const std::function<bool()>& stop) : systems_(systems) {
    for (Simulation& system : systems_) system.stop_when(stop);
  }
  ~Watched() {
    for (Simulation& system : systems_) system.stop_when({});
  }
  Watched(const Watched&) = delete;
  Watched& operator=(const Watched&) = delete;

 private:
  std::vector<Simulation>& systems_;
};

double done_of(std::span<const Track> tracks) {
  double done = 1;
  for (const Track& track : tracks) {
    const auto left = static_cast<double>(track.steps() - track.system().step_count());
    const auto taken = static_cast<double>(track.taken());
    if (left > 0) done = std::min(done, taken / (taken + left));
  }
  return done;
}

// The choice was made for this run: what it measured verifies it.
bool is_chosen_run(const sim_scene& scene, double time) {
  return !scene.choices.empty() && scene.generation == scene.chosen_at &&
         std::max(0.0, time) == std::max(0.0, scene.chosen.time);
}

void run(sim_scene& scene, double time, int wish, Watcher& watcher) {
  using Clock = std::chrono::steady_clock;
  if (scene.generation == 1 && asks_for_error(scene)) choose(scene, {.time = time}, watcher);
  const bool chosen = is_chosen_run(scene, time);
  ++scene.generation;
  StudiedScene& loaded = scene.loaded;
  scene.verdicts.clear();
  scene.summary.clear();
  std::vector<Track> tracks;
  tracks.reserve(loaded.systems.size());
  for (std::size_t i = 0; i < loaded.systems.size(); ++i) {
    Simulation& system = loaded.systems[i];
    const study::RunLength length{time > 0 ? system.t() + time : system.duration(), {}};
    const std::int64_t steps = std::max(study::steps_of(length, system), system.step_count());
    tracks.emplace_back(loaded.spec.systems[i], system, steps, Track::kNever, Track::kNever,
                        scene.registry.get());
    study::shorten(length, tracks.back());
    if (!chosen || !scene.choices[i]) continue;
    study::RunDeviation known = report::goal_deviation(*scene.choices[i], scene.chosen.of);
    if (known.verified()) tracks.back().verified_by(std::move(known));
  }
  const char* what = "run";
  const std::function<bool()> stop = [&] { return watcher.stopped(what, done_of(tracks)); };
  const Clock::time_point begin = Clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  const study::VerificationPlan plan{.wish = static_cast<study::Verify>(wish)};
  bool early = true;
  const auto verify_beside = [&] {
    if (!early || seconds() < Track::kQuick) return;
    early = false;
    study::verify_beside(plan, tracks, loaded.systems.front().threads(),
                         [&] { return watcher.told(); });
  };
  {
    const Watched watched(loaded.systems, stop);
    study::follow_all(tracks, stop, verify_beside);
  }
  scene.seconds = seconds();
  what = "verification";
  if (!watcher.told()) study::verify(plan, tracks, scene.seconds, stop);
  std::vector<study::Verdict> verdicts;
  for (Track& track : tracks) verdicts.push_back(track.verdict());
  scene.summary = report::summary_json(loaded, tracks, scene.seconds, {},
                                       chosen ? choice_texts(scene) : std::vector<std::string>());
  scene.verdicts = std::move(verdicts);
}

const study::Verdict& verdict_of(const sim_scene* scene, int system) {
  system_of(scene, system);
  if (scene->verdicts.empty())
    refuse("no verdict", "scene", "there was no judged run", "call sim_run() first");
  return scene->verdicts[static_cast<std::size_t>(system)];
}

}  // namespace

extern "C" {

int sim_run(sim_scene* scene, double time, int verify, sim_watch watch, void* user,
            sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    if (std::isnan(time)) refuse("bad value", "time", "it is not a number", "give it in s");
    if (verify < 0 || verify > 2)
      refuse("bad value", "verify " + std::to_string(verify), "it is 0, 1 or 2", "1 is usual");
    Watcher watcher(watch, user);
    stoppable(*scene, [&] { run(*scene, time, verify, watcher); });
    if (watcher.told()) throw Stopped();
  });
}

int sim_judge(const sim_scene* scene, int system, sim_verdict* verdict, sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    const study::Verdict& found = verdict_of(scene, system);
    const study::Figures& figures = found.figures;
    checked(verdict, "verdict") = {static_cast<int>(found.trust),
                                   figures.energy,
                                   figures.dt_share,
                                   figures.step_error,
                                   figures.momentum,
                                   figures.shadow.error,
                                   figures.shadow.share,
                                   figures.shadow.horizon,
                                   scene->seconds};
  });
}

int sim_figure(const sim_scene* scene, int system, const char* name, double* value,
               sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    const study::Verdict& found = verdict_of(scene, system);
    checked(value, "value") = report::figure_named(found.figures, checked_text(name, "name"));
  });
}

char* sim_verdict_json(const sim_scene* scene, sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    verdict_of(scene, 0);
    return given_away(scene->summary);
  });
}

const char* sim_trust_name(int trust) {
  return trust < 0 || trust > static_cast<int>(study::Trust::kDiverged)
             ? ""
             : study::trust_name(static_cast<study::Trust>(trust));
}

}  // extern "C"
