#include "cli/prompt/repl_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cli/run/judged.h"
#include "cli/terminal/signals.h"
#include "core/base/error.h"
#include "core/base/stopwatch.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/study/run/verification.h"

namespace sim::cli {
namespace {

constexpr double kMostDurations = 100;     // of a run until something happens
constexpr double kLongestUnknown = 100.0;  // s, of scenes without a duration

bool go_on() { return !SessionSignals::any(); }

[[noreturn]] void usage_error(const std::string& what, const std::string& why,
                              const std::string& remedy) {
  throw Error(ErrorKind::kUsage, {what, "", why, remedy});
}

void check_steps(double steps) {
  if (!(steps < static_cast<double>(kMostSteps)))
    usage_error("too many steps", "a run has at most 9e15", "choose a larger .dt or less time");
}

}  // namespace

LiveScene::LiveScene(const SceneRequest& request, const Environment& environment,
                     Registry& registry, std::size_t budget, std::ostream& err, bool progress)
    : environment_(environment),
      registry_(registry),
      budget_(budget),
      err_(err),
      progress_(progress),
      origin_(read_origin(request, environment, registry)),
      current_(origin_->first_choice()) {
  for (const Simulation& each : scene().systems) timelines_.emplace_back(each, budget);
  share_budget();
}

Track LiveScene::track(std::size_t system) {
  Simulation& simulation = origin_->scene.systems[system];
  Track track(origin_->scene.spec.systems[system], simulation, simulation.step_count(), 1, 1);
  const std::vector<double>* const known = ledger_.find(system, simulation);
  if (known) track.continue_from(start_energy(system), *known);
  if (std::isnan(work(system))) track.forget_work();
  track.set_start(start_energy(system));
  return track;
}

double LiveScene::start_energy(std::size_t system) const {
  return timelines_[system].start_energy(origin_->scene.systems[system]);
}

double LiveScene::drift(std::size_t system, const Energy& now) const {
  return now.total() + work(system) - start_energy(system);
}

void LiveScene::share_budget() {
  for (Timeline& timeline : timelines_)
    timeline.set_budget(budget_ / (timelines_.size() * (branches_.size() + 1)));
}

// The condition of .until may read, but not change, the running scene.
void LiveScene::check_idle() {
  if (running_) usage_error("a run is going on", "its condition asks for a change", "only look");
  judge_steps();
}

// --- Time -------------------------------------------------------------------------------------

LiveScene::Outcome LiveScene::advance(LoadedScene& scene, std::vector<Timeline>& timelines,
                                      const std::vector<std::int64_t>& targets,
                                      const Condition* until, std::optional<double> seconds,
                                      bool judge) {
  struct Running {
    bool& flag;
    ~Running() { flag = false; }
  } const running{running_};
  running_ = true;
  std::vector<Track> tracks;
  bool repeats = false, moved = false, diverged = false, beside = false;
  std::optional<double> cut;
  const double from = scene.systems.front().t();
  std::vector<bool> accounted;  // the work so far is known
  const Stopwatch watch;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    Simulation& system = scene.systems[i];
    system.stop_when(SessionSignals::any);
    tracks.emplace_back(scene.spec.systems[i], system, targets[i], Track::kNever, Track::kNever,
                        &registry_);
    if (until) tracks.back().end_anywhere();
    const std::vector<double>* const known =
        &scene == &origin_->scene ? ledger_.find(i, system) : nullptr;
    accounted.push_back(&scene == &origin_->scene && (known || system.step_count() == 0));
    if (known) tracks.back().continue_from(start_energy(i), *known);
    if (&scene == &origin_->scene) tracks.back().doubt_start(origin_->doubt);
    // A recording counts equal steps; known steps stay.
    if (seconds && !writer_ && targets[i] > timelines[i].last())
      shorten(system.t() + *seconds, tracks.back());
    if (i == 0) cut = tracks.back().short_step();
    repeats |= timelines[i].edits() > 0 && timelines[i].last() > system.step_count();
    tracks.back().sample();
  }
  Progress progress(err_, progress_);
  while (!(until && (*until)())) {
    std::size_t next = tracks.size();
    for (std::size_t i = 0; i < tracks.size(); ++i)
      if (!tracks[i].finished() &&
          (next == tracks.size() || scene.systems[i].t() < scene.systems[next].t()))
        next = i;
    if (next == tracks.size()) break;
    SessionSignals::check();
    moved = true;
    int taken = 0;
    try {
      std::int64_t most = tracks.size() == 1 && !until ? tracks[next].due() : 1;
      for (const Look& look : looks)
        most = std::min(most, look.every - scene.systems[next].step_count() % look.every);
      Track& track = tracks[next];
      if (const auto end = track.cut()) {
        taken = timelines[next].step_to(track.system(), *end) ? 1 : 0;
      } else {
        if (track.short_step())
          most = std::min(most, track.steps() - track.system().step_count() - 1);
        taken = timelines[next].steps(track.system(), most);
      }
    } catch (const Error& error) {
      SessionSignals::check();  // Lua was stopped
      throw in_step(error, scene.systems[next]);
    }
    if (taken == 0) {
      SessionSignals::check();
      tracks[next].mark_diverged();
      diverged = true;
      break;
    }
    tracks[next].sample();
    if (!beside && judge && !until && watch.seconds() > Track::kQuick) {
      beside = true;
      study::verify_beside({}, tracks, scene.systems[next].threads(), SessionSignals::any);
    }
    if (&scene == &origin_->scene) take_looks(next);
    progress.update(tracks);
  }
  for (std::size_t i = 0; i < tracks.size(); ++i)
    if (accounted[i]) ledger_.keep(i, scene.systems[i], tracks[i].work_memory());
  if (repeats || !moved || (!judge && !diverged)) return {};
  if (until)
    for (Track& track : tracks) track.leave_unverified("positions not verified");
  else
    study::verify({}, tracks, watch.seconds(), SessionSignals::any);
  const Verdict verdict = overall_verdict(tracks);
  judged_ = {verdict, from, scene.systems.front().t(), cut,
             tracks.front().began_anew() ? scene.systems.front().method().name() : ""};
  if (verdict.trust == Trust::kDiverged)
    throw Error(ErrorKind::kDiverged, {"diverged", scene.spec.file, verdict.reason,
                                       "try a smaller .dt or another .integrator"});
  return verdict;
}

void LiveScene::take_looks(std::size_t index) {
  if (index != current_) return;
  for (const Look& look : looks)
    if (system().step_count() % look.every == 0) look.take();
}

std::vector<std::int64_t> LiveScene::present_steps() const {
  std::vector<std::int64_t> steps;
  for (const Simulation& each : scene().systems) steps.push_back(each.step_count());
  return steps;
}

const std::optional<Judged>& LiveScene::judged() {
  judge_steps();
  return judged_;
}

// Judges the steps as one run, which is repeated, from where the history begins at least.
// Interrupted or not, it ends where it was.
void LiveScene::judge_steps() {
  if (running_) return;
  const std::optional<Stepped> stepped = std::exchange(stepped_, {});
  if (!stepped || stepped->to != present_steps()) return;
  struct Quiet {
    LiveScene& live;
    const std::vector<std::int64_t>& to;
    std::vector<Look> looks = std::exchange(live.looks, {});
    ~Quiet() {
      live.looks = std::move(looks);
      for (std::size_t i = 0; i < to.size(); ++i)
        live.timelines_[i].go_to(live.loaded().systems[i], to[i], [] { return true; });
    }
  } const quiet{*this, stepped->to};
  for (std::size_t i = 0; i < timelines_.size(); ++i)
    timelines_[i].go_to(origin_->scene.systems[i],
                        std::max(stepped->from[i], timelines_[i].first()), go_on);
  SessionSignals::check();
  advance(origin_->scene, timelines_, stepped->to);
}

// If the history has changes by the user, which no repetition judges, each command is judged at
// once.
LiveScene::Outcome LiveScene::step(std::int64_t steps) {
  const bool repeatable =
      std::ranges::all_of(timelines_, [](const Timeline& each) { return each.edits() == 0; });
  const std::vector<std::int64_t> from = present_steps();
  if (running_ || !repeatable || (stepped_ && stepped_->to != from)) check_idle();
  std::vector<std::int64_t> targets;
  for (const Simulation& system : origin_->scene.systems) {
    check_steps(static_cast<double>(system.step_count()) + static_cast<double>(steps));
    targets.push_back(system.step_count() + steps);
  }
  if (!repeatable) return advance(origin_->scene, timelines_, targets);
  if (!stepped_) stepped_ = {from, from};
  advance(origin_->scene, timelines_, targets, nullptr, {}, false);
  stepped_->to = targets;
  return {};
}

std::vector<std::int64_t> LiveScene::targets_after(double seconds) const {
  std::vector<std::int64_t> targets;
  for (const Simulation& system : origin_->scene.systems) {
    check_steps(static_cast<double>(system.step_count()) + seconds / system.h());
    targets.push_back(std::max(system.step_count(), system.steps_for(system.t() + seconds)));
  }
  return targets;
}

LiveScene::Outcome LiveScene::run(double seconds) {
  check_idle();
  return advance(origin_->scene, timelines_, targets_after(seconds), nullptr, seconds);
}

LiveScene::Outcome LiveScene::run_until(const Condition& until) {
  check_idle();
  double most = kLongestUnknown;
  for (const Simulation& system : origin_->scene.systems)
    if (system.duration() > 0) most = std::max(most, kMostDurations * system.duration());
  bool held = false;
  const Condition ask = [&] { return held = until(); };
  Outcome outcome = advance(origin_->scene, timelines_, targets_after(most), &ask);
  if (!held)
    throw Error(ErrorKind::kCheck,
                {"the condition did not hold", "",
                 "the run was given up after " + brief(most) + " s", "run it again to go on"});
  return outcome;
}

void LiveScene::reset() {
  check_idle();
  for (std::size_t i = 0; i < timelines_.size(); ++i) {
    Simulation& each = origin_->scene.systems[i];
    if (writer_) writer_->reset(recorded_name(i), each.step_count());
    each.reset();
    timelines_[i] = Timeline(origin_->scene.systems[i], budget_);
  }
  share_budget();
}

// Known steps are restored and repeated; new ones are run.
void LiveScene::travel(const std::vector<std::int64_t>& steps) {
  for (std::size_t i = 0; i < steps.size(); ++i) {
    Simulation& each = origin_->scene.systems[i];
    const std::int64_t from = each.step_count();
    timelines_[i].go_to(each, std::min(steps[i], timelines_[i].last()), go_on);
    if (writer_ && each.step_count() < from)
      writer_->back(recorded_name(i), from, each.step_count());
    SessionSignals::check();
  }
  advance(origin_->scene, timelines_, steps);
}

void LiveScene::back(std::int64_t steps) {
  check_idle();
  std::vector<std::int64_t> targets;
  for (std::size_t i = 0; i < timelines_.size(); ++i) {
    const std::int64_t now = origin_->scene.systems[i].step_count(), first = timelines_[i].first();
    targets.push_back(now - std::min(steps, now + 1));
    if (targets.back() >= first) continue;
    if (first == 0)
      usage_error("cannot go back " + counted(steps, "step"),
                  counted(now, "step") + " have been taken", ".reset starts over");
    usage_error("cannot go back " + counted(steps, "step"),
                "the history begins at step " + std::to_string(first) +
                    ": what is older did not fit its memory",
                "start simrepl with a larger --history");
  }
  travel(targets);
}

void LiveScene::go_to(double t) {
  check_idle();
  std::vector<std::int64_t> targets;
  for (std::size_t i = 0; i < timelines_.size(); ++i) {
    if (t < timelines_[i].first_t())
      usage_error("cannot go to t = " + brief(t) + " s",
                  "the history begins at t = " + brief(timelines_[i].first_t()) + " s",
                  timelines_[i].first() > 0 ? "start simrepl with a larger --history" : "");
    check_steps(t / origin_->scene.systems[i].h());
    targets.push_back(timelines_[i].step_at(origin_->scene.systems[i], t));
  }
  travel(targets);
}

bool LiveScene::undo() {
  check_idle();
  const double t = system().t();
  std::vector<std::int64_t> steps;
  for (const Simulation& each : origin_->scene.systems) steps.push_back(each.step_count());
  const std::size_t before = timelines_[current_].actions();
  if (!timelines_[current_].undo(system())) return false;
  if (writer_)
    writer_->undo(recorded_name(current_), before - timelines_[current_].actions(), steps[current_],
                  system().step_count());
  steps[current_] = timelines_[current_].step_at(system(), t);
  travel(steps);
  return true;
}

void LiveScene::part() { timelines_[current_].part(system()); }

void LiveScene::act(const Action& action) {
  check_idle();
  if (action.what == Action::What::kReset) return reset();
  timelines_[current_].act(system(), action);
  if (writer_) writer_->action(recorded_name(current_), system().step_count(), action);
}

void LiveScene::lend(const std::function<void(std::vector<Timeline>&, RecordingWriter*)>& play) {
  check_idle();
  play(timelines_, writer_);
  share_budget();
}

void LiveScene::edit(const std::function<void(Simulation&)>& change) {
  check_idle();
  check_one_way();
  timelines_[current_].edit(system(), change);
}

std::string LiveScene::recorded_name(std::size_t index) const {
  return scene().spec.world ? scene().systems[index].name() : "";
}

void LiveScene::check_one_way() const {
  if (writer_)
    usage_error("not in a recording", "it goes one way through one scene",
                "leave out --record, or say it before");
}

void LiveScene::end_record() {
  for (std::size_t i = 0; writer_ && i < timelines_.size(); ++i) {
    const Simulation& each = scene().systems[i];
    writer_->end(recorded_name(i), each.step_count(), each.hash());
  }
  writer_ = nullptr;
}

}  // namespace sim::cli
