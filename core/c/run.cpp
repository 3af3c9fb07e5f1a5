// Judged runs.
#include <cmath>
#include <cstring>

#include "core/base/stopwatch.h"
#include "core/c/handles.h"
#include "core/c/run.h"
#include "core/c/watcher.h"
#include "core/output/format.h"
#include "core/report/check.h"
#include "core/report/goal_report.h"
#include "core/report/rest_report.h"
#include "core/report/summary.h"
#include "core/study/run/follow.h"
#include "core/study/run/verification.h"

using namespace sim;
using namespace sim::c;

namespace {

using study::Track;

// The quantities asked for that are figures of a whole run.
std::vector<study::Quantity> figures_of(const SystemSpec& spec,
                                        const std::vector<std::string>& judged) {
  std::vector<study::Quantity> figures;
  for (const std::string& text : judged) figures.emplace_back(spec, text);
  return figures;
}

// A function of the scene was ended within a step: the methods begin anew where it began.
void give_up(std::vector<Track>& tracks) {
  for (Track& track : tracks) {
    Snapshot now = track.system().snapshot();
    now.memory.clear();
    track.system().restore(now);
    if (!track.finished() && !track.stuck()) track.mark_interrupted();
  }
}

// The choice was made for this run: what it measured verifies it.
bool is_chosen_run(const sim_scene& scene, const RunTask& task) {
  return !task.replays && !task.engine && !scene.choices.empty() &&
         scene.generation == scene.chosen_at &&
         std::max(0.0, task.time) == std::max(0.0, scene.chosen.time);
}

// A recording has whole steps.
void check_recorded(const sim_scene& scene, const Track& track) {
  if (scene.record && track.end() < track.system().t(track.steps()))
    refuse("not in a recording", "time",
           "the last step would be shorter than the others, and a recording has whole ones",
           "give a multiple of dt, or take steps");
}

}  // namespace

namespace sim::c {

void check_verify(int verify) {
  if (verify < 0 || verify > 2)
    refuse("bad value", "verify " + std::to_string(verify), "it is 0, 1 or 2", "1 is usual");
}

void run(sim_scene& scene, const RunTask& task, Watcher& watcher) {
  const double time = task.time;
  if (!task.replays && !task.engine && scene.generation == 1 && asks_for_error(scene, true))
    choose(scene, {.time = time}, watcher);
  const bool chosen = is_chosen_run(scene, task);
  const bool goes_on = scene.resumed && scene.accounts_at == scene.generation;
  scene.resumed = false;
  ++scene.generation;
  StudiedScene& loaded = scene.loaded;
  scene.verdicts.clear();
  scene.summary.clear();
  const char* what = "run";
  const std::vector<Track>* running = nullptr;
  // Functions of the scene may ask on other threads, too, in runs beside this one.
  const std::function<bool()> stop = [&] {
    if (!watcher.is_own_thread()) return watcher.told();
    return watcher.stopped(what, running ? study::done_share(*running) : 0);
  };
  const Stop::By asked(*scene.stop, stop);
  std::vector<Track> tracks;
  tracks.reserve(loaded.systems.size());
  for (std::size_t i = 0; i < loaded.systems.size(); ++i) {
    Simulation& system = loaded.systems[i];
    study::RunLength length{time > 0 ? system.t() + time : system.duration(), {}};
    if (task.length) length = *task.length;
    if (task.replays) length = {{}, task.replays->steps(i)};
    const std::int64_t steps = std::max(study::steps_of(length, system), system.step_count());
    const std::int64_t rows = task.engine
                                  ? task.rows.value_or(study::row_stride(steps, loaded.spec.world))
                                  : Track::kNever;
    tracks.emplace_back(loaded.spec.systems[i], system, steps, Track::kNever, rows,
                        scene.registry.get());
    study::shorten(length, tracks.back());
    check_recorded(scene, tracks.back());
    tracks.back().judge(figures_of(loaded.spec.systems[i], scene.judged));
    if (goes_on) {
      tracks.back().continue_from(scene.accounts[i].start_energy, scene.accounts[i].work);
      tracks.back().doubt_start(scene.accounts[i].doubt);
    }
    if (!chosen || !scene.choices[i]) continue;
    study::RunDeviation known = report::goal_deviation(*scene.choices[i], scene.chosen.of);
    if (known.verified()) tracks.back().verified_by(std::move(known), scene.choices[i]->allowed);
  }
  running = &tracks;
  const Stopwatch watch;
  const study::VerificationPlan plan{.wish = static_cast<study::Verify>(task.verify)};
  engine::StepSource source(loaded.spec, tracks, task.replays);
  if (task.engine)
    source.use(*task.engine, *scene.registry, stop, [&task](const std::string& note) {
      if (task.notes) task.notes->push_back(note);
    });
  source.start();
  study::Advance advance;
  if (task.replays || task.engine)
    advance = [&source](Track& track, std::int64_t most) {
      source.perform(track);
      return source.advance(track, most);
    };
  bool early = true;
  const auto verify_beside = [&] {
    if (!early || watch.seconds() < Track::kQuick) return;
    early = false;
    study::verify_beside(plan, tracks, loaded.systems.front().threads(),
                         [&] { return watcher.told(); });
  };
  try {
    study::follow_all(tracks, stop, verify_beside, advance);
    source.finish();
  } catch (const Error&) {
    if (!watcher.told()) throw;
    give_up(tracks);
  }
  scene.seconds = watch.seconds();
  what = "verification";
  if (!watcher.told()) study::verify(plan, tracks, scene.seconds, stop);
  for (std::size_t i = 0; chosen && i < tracks.size(); ++i)
    if (scene.choices[i]) report::take_missed_pulse(tracks[i], *scene.choices[i]);
  std::vector<study::Verdict> verdicts;
  for (Track& track : tracks) verdicts.push_back(track.verdict());
  scene.summary = report::summary_json(loaded, tracks, scene.seconds, {},
                                       chosen ? choice_texts(scene) : std::vector<std::string>());
  scene.verdicts = std::move(verdicts);
  scene.accounts = report::accounts_of(tracks);
  scene.accounts_at = scene.generation;
}

}  // namespace sim::c

namespace {

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
    check_verify(verify);
    Watcher watcher(watch, user);
    stoppable_by(watcher, [&] {
      stoppable(*scene, [&] { c::run(*scene, {.time = time, .verify = verify}, watcher); });
    });
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

int sim_judge_figures(sim_scene* scene, const char* const* of, sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    std::vector<std::string> judged;
    for (; of && *of; ++of) judged.emplace_back(*of);
    for (const SystemSpec& spec : scene->loaded.spec.systems)
      for (const study::Quantity& each : figures_of(spec, judged))
        if (!each.is_figure())
          refuse("not of a whole run", each.text(), "it is a quantity of a moment",
                 "name a figure of it, like \"mean " + each.text() + "\"");
    scene->judged = std::move(judged);
  });
}

int sim_check(const sim_scene* scene, const char* limits, sim_error* error) {
  return guarded(error, [&] {
    const InCall call(scene);
    const report::Checks checks = report::parse_checks("limits", checked_text(limits, "limits"));
    for (std::size_t i = 0; i < scene->loaded.systems.size(); ++i)
      report::check(checks, verdict_of(scene, static_cast<int>(i)),
                    scene->loaded.systems[i].name());
  });
}

char* sim_come_to_rest(sim_scene* scene, sim_watch watch, void* user, sim_error* error) {
  return guarded_pointer(error, [&] {
    const InCall call(scene);
    refuse_in_record(*scene, "come_to_rest");
    Watcher watcher(watch, user);
    ++scene->generation;
    std::vector<std::string> texts;
    const std::function<bool()> stop = [&] { return watcher.stopped("rest", 0.5); };
    std::vector<Snapshot> before;
    for (const Simulation& system : scene->loaded.systems) before.push_back(system.snapshot());
    try {
      const Stop::By asked(*scene->stop, stop);
      for (Simulation& system : scene->loaded.systems)
        texts.push_back(report::rest_json(system, report::rest_of(system, stop)));
    } catch (...) {
      for (std::size_t i = 0; i < before.size(); ++i) scene->loaded.systems[i].restore(before[i]);
      listen(*scene);
      if (watcher.told()) throw Stopped();
      throw;
    }
    listen(*scene);
    return given_away(JsonObject().json("systems", json_array(texts)).str());
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
