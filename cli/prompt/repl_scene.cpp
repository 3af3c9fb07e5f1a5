#include "cli/prompt/repl_scene.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>

#include "cli/run/checkpoint_file.h"
#include "cli/terminal/signals.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"

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

std::vector<Settings> settings_of(const LoadedScene& scene) {
  std::vector<Settings> list;
  for (const Simulation& each : scene.systems) list.push_back(each.settings());
  return list;
}

std::size_t first_choice(const LoadedScene& scene) {
  for (std::size_t i = 0; i < scene.systems.size(); ++i)
    if (scene.systems[i].second_order()) return i;
  return 0;
}

}  // namespace

LiveScene::LiveScene(const SceneRequest& request, const Environment& environment,
                     Registry& registry, std::size_t budget, std::ostream& err, bool progress)
    : request_(request),
      environment_(environment),
      registry_(registry),
      budget_(budget),
      err_(err),
      progress_(progress),
      scene_(load(request, environment, registry)),
      loaded_(settings_of(scene_)),
      current_(first_choice(scene_)) {
  for (const Simulation& each : scene_.systems) timelines_.emplace_back(each, budget);
  share_budget();
}

Track LiveScene::track(std::size_t system) {
  Simulation& simulation = scene_.systems[system];
  Track track(scene_.spec.systems[system], simulation, simulation.step_count(), 1, 1);
  const std::vector<double>* const known = ledger_.find(system, simulation);
  if (known) track.continue_from(start_energy(system), *known);
  if (std::isnan(work(system))) track.forget_work();
  track.set_start(start_energy(system));
  return track;
}

double LiveScene::start_energy(std::size_t system) const {
  return timelines_[system].start_energy(scene_.systems[system]);
}

double LiveScene::drift(std::size_t system, const Energy& now) const {
  return now.total() + work(system) - start_energy(system);
}

void LiveScene::share_budget() {
  for (Timeline& timeline : timelines_)
    timeline.set_budget(budget_ / (timelines_.size() * (branches_.size() + 1)));
}

// The condition of .until may look, but not change what is being run.
void LiveScene::check_idle() const {
  if (running_) usage_error("a run is going on", "its condition asks for a change", "only look");
}

// --- Time -------------------------------------------------------------------------------------

LiveScene::Outcome LiveScene::advance(LoadedScene& scene, std::vector<Timeline>& timelines,
                                      const std::vector<std::int64_t>& targets,
                                      const Condition* until) {
  struct Running {
    bool& flag;
    ~Running() { flag = false; }
  } const running{running_};
  running_ = true;
  std::vector<Track> tracks;
  bool repeats = false, moved = false;
  std::vector<bool> accounted;  // the work so far is known
  const auto begin = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < targets.size(); ++i) {
    Simulation& system = scene.systems[i];
    system.stop_when(SessionSignals::any);
    tracks.emplace_back(scene.spec.systems[i], system, targets[i], Track::kNever, Track::kNever,
                        &registry_);
    const std::vector<double>* const known = &scene == &scene_ ? ledger_.find(i, system) : nullptr;
    accounted.push_back(&scene == &scene_ && (known || system.step_count() == 0));
    if (known) tracks.back().continue_from(start_energy(i), *known);
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
      const bool alone = tracks.size() == 1 && !until;
      taken = timelines[next].steps(scene.systems[next], alone ? tracks[next].due() : 1);
    } catch (const Error& error) {
      throw in_step(error, scene.systems[next]);
    }
    if (taken == 0) {
      SessionSignals::check();
      tracks[next].mark_diverged();
      break;
    }
    tracks[next].sample();
    progress.update(tracks);
  }
  for (std::size_t i = 0; i < tracks.size(); ++i)
    if (accounted[i]) ledger_.keep(i, scene.systems[i], tracks[i].work_memory());
  if (repeats || !moved) return {};
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  for (Track& track : tracks)
    if (!until && seconds < Track::kQuick)
      track.verify(SessionSignals::any);
    else
      track.leave_unverified("positions not verified");
  const Verdict verdict = overall_verdict(tracks);
  if (verdict.trust == Trust::kDiverged)
    throw Error(ErrorKind::kDiverged, {"diverged", scene.spec.file, verdict.reason,
                                       "try a smaller .dt or another .integrator"});
  return verdict;
}

LiveScene::Outcome LiveScene::step(std::int64_t steps) {
  check_idle();
  std::vector<std::int64_t> targets;
  for (const Simulation& system : scene_.systems) {
    check_steps(static_cast<double>(system.step_count()) + static_cast<double>(steps));
    targets.push_back(system.step_count() + steps);
  }
  return advance(scene_, timelines_, targets);
}

std::vector<std::int64_t> LiveScene::targets_after(double seconds) const {
  std::vector<std::int64_t> targets;
  for (const Simulation& system : scene_.systems) {
    check_steps(static_cast<double>(system.step_count()) + seconds / system.h());
    targets.push_back(std::max(system.step_count(), system.steps_for(system.t() + seconds)));
  }
  return targets;
}

LiveScene::Outcome LiveScene::run(double seconds) {
  check_idle();
  return advance(scene_, timelines_, targets_after(seconds));
}

LiveScene::Outcome LiveScene::run_until(const Condition& until) {
  check_idle();
  double most = kLongestUnknown;
  for (const Simulation& system : scene_.systems)
    if (system.duration() > 0) most = std::max(most, kMostDurations * system.duration());
  bool held = false;
  const Condition ask = [&] { return held = until(); };
  Outcome outcome = advance(scene_, timelines_, targets_after(most), &ask);
  if (!held)
    throw Error(ErrorKind::kCheck,
                {"the condition did not hold", "",
                 "the run was given up after " + brief(most) + " s", "run it again to go on"});
  return outcome;
}

void LiveScene::reset() {
  check_idle();
  for (std::size_t i = 0; i < timelines_.size(); ++i) {
    scene_.systems[i].reset();
    timelines_[i] = Timeline(scene_.systems[i], budget_);
  }
  share_budget();
}

// What is known is restored and run again; what is not is run.
void LiveScene::travel(const std::vector<std::int64_t>& steps) {
  for (std::size_t i = 0; i < steps.size(); ++i) {
    timelines_[i].go_to(scene_.systems[i], std::min(steps[i], timelines_[i].last()), go_on);
    SessionSignals::check();
  }
  advance(scene_, timelines_, steps);
}

void LiveScene::back(std::int64_t steps) {
  check_idle();
  std::vector<std::int64_t> targets;
  for (std::size_t i = 0; i < timelines_.size(); ++i) {
    const std::int64_t now = scene_.systems[i].step_count(), first = timelines_[i].first();
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
    check_steps(t / scene_.systems[i].h());
    targets.push_back(timelines_[i].step_at(scene_.systems[i], t));
  }
  travel(targets);
}

bool LiveScene::undo() {
  check_idle();
  std::vector<std::int64_t> steps;
  for (const Simulation& each : scene_.systems) steps.push_back(each.step_count());
  if (!timelines_[current_].undo(system())) return false;
  travel(steps);
  return true;
}

void LiveScene::edit(const std::function<void(Simulation&)>& change) {
  check_idle();
  timelines_[current_].edit(system(), change);
}

// --- Settings and the file --------------------------------------------------------------------

void LiveScene::set_integrator(const MethodChoice& choice) {
  std::optional<Method> method;
  try {
    method.emplace(registry_, typed(choice, choice.name, registry_));
  } catch (const Error& error) {  // which speaks of a command line
    ErrorText text = error.text();
    text.where.clear();
    throw Error(error.kind(), text);
  }
  edit([&](Simulation& each) { each.set_integrator(*method); });
}

void LiveScene::set_dt(double h) {
  edit([&](Simulation& each) { each.set_dt(h); });
}

void LiveScene::apply_choices(LoadedScene& scene) const {
  for (Simulation& each : scene.systems)
    for (std::size_t i = 0; i < loaded_.size(); ++i) {
      const Simulation& old = scene_.systems[i];
      if (old.name() != each.name() && scene_.spec.world) continue;
      const Settings &chosen = old.settings(), &given = loaded_[i];
      if (chosen.method.choice() != given.method.choice()) each.set_integrator(chosen.method);
      if (chosen.h != given.h) each.set_dt(chosen.h);
    }
}

std::vector<Change> LiveScene::reload(
    const std::optional<std::pair<std::string, std::string>>& setting) {
  check_idle();
  SceneRequest request = request_;
  if (setting) request.settings[setting->first] = setting->second;
  LoadedScene fresh = load(request, environment_, registry_);
  std::vector<Settings> loaded = settings_of(fresh);
  apply_choices(fresh);
  std::vector<Timeline> timelines;
  std::vector<std::int64_t> targets;
  const auto before = [&](const Simulation& each) {
    return std::find_if(scene_.systems.begin(), scene_.systems.end(),
                        [&](const Simulation& old) { return old.name() == each.name(); });
  };
  for (const Simulation& each : fresh.systems) {
    const auto old = before(each);
    const double t = old == scene_.systems.end() ? scene_.systems.front().t() : old->t();
    timelines.emplace_back(each, budget_ / fresh.systems.size());
    targets.push_back(timelines.back().step_at(each, t));
  }
  advance(fresh, timelines, targets);

  std::vector<Change> changes = differences(scene_, fresh);
  int edits = 0;
  for (const Timeline& timeline : timelines_) edits += timeline.edits();
  if (edits > 0)
    changes.push_back(
        {"changes by hand", std::to_string(edits), "only integrator and dt, from the start"});
  if (!branches_.empty())
    changes.push_back({"branches", std::to_string(branches_.size() + 1), "1"});
  const std::string name = system().name();
  request_ = std::move(request);
  scene_ = std::move(fresh);
  timelines_ = std::move(timelines);
  branches_.clear();
  branch_ = "main";
  loaded_ = std::move(loaded);
  current_ = first_choice(scene_);
  for (std::size_t i = 0; i < scene_.systems.size(); ++i)
    if (scene_.systems[i].name() == name) current_ = i;
  return changes;
}

// --- Branches ---------------------------------------------------------------------------------

LiveScene::Branch LiveScene::present() {
  Branch branch;
  for (std::size_t i = 0; i < timelines_.size(); ++i) {
    timelines_[i].keep(scene_.systems[i]);
    branch.steps.push_back(scene_.systems[i].step_count());
  }
  branch.timelines = timelines_;
  branch.t = scene_.systems.front().t();
  return branch;
}

std::map<std::string, LiveScene::Branch> LiveScene::branches() {
  auto all = branches_;
  all.emplace(branch_, present());
  return all;
}

LiveScene::Branch LiveScene::branch_named(const std::string& name) {
  const auto all = branches();
  if (const auto found = all.find(name); found != all.end()) return found->second;
  std::vector<std::string> known;
  for (const auto& [each, branch] : all) known.push_back(each);
  usage_error("unknown branch '" + name + "'", "there is no branch of that name",
              suggestion(name, known));
}

void LiveScene::add_branch(const std::string& name) {
  check_idle();
  if (name == branch_ || branches_.contains(name))
    usage_error("branch '" + name + "' exists", "two cannot have one name",
                ".switch " + name + " goes there");
  branches_.emplace(name, present());
  share_budget();
}

void LiveScene::switch_to(const std::string& name) {
  check_idle();
  const Branch there = branch_named(name);
  branches_[branch_] = present();
  branches_.erase(name);
  branch_ = name;
  timelines_ = there.timelines;
  for (std::size_t i = 0; i < timelines_.size(); ++i)
    timelines_[i].enter(scene_.systems[i], there.steps[i], go_on);
  share_budget();
  SessionSignals::check();
}

std::optional<LiveScene::FirstDifference> LiveScene::diff(const std::string& a,
                                                          const std::string& b) {
  Branch left = branch_named(a), right = branch_named(b);
  std::optional<FirstDifference> first;
  for (std::size_t i = 0; i < scene_.systems.size(); ++i) {
    const SystemSpec& spec = scene_.spec.systems[i];
    const RunOptions options{.threads = request_.threads};
    Simulation one(spec, registry_, options), other(spec, registry_, options);
    Timeline &here = left.timelines[i], &there = right.timelines[i];
    const std::int64_t end = std::min(left.steps[i], right.steps[i]);
    const std::int64_t common = here.common(there);
    std::int64_t step = std::min(end, std::max({common, here.first(), there.first()}));
    here.enter(one, step, go_on);
    there.enter(other, step, go_on);
    for (;; ++step) {
      SessionSignals::check();
      if (const auto found = first_difference(one, other)) {
        if (!first || one.t() < first->ta)
          first = {spec.name, step, common, one.t(), other.t(), *found};
        break;
      }
      if (step == end || !here.step(one) || !there.step(other)) break;
    }
  }
  return first;
}

// --- Checkpoints ------------------------------------------------------------------------------

void LiveScene::save(const std::string& file) {
  std::vector<Account> accounts;
  for (std::size_t i = 0; i < timelines_.size(); ++i) {
    const std::vector<double>* const known = ledger_.find(i, scene_.systems[i]);
    accounts.push_back({start_energy(i), known ? *known : std::vector<double>()});
  }
  save_checkpoint(file, request_, scene_, accounts, std::cout);
}

void LiveScene::resume(const std::string& file) {
  check_idle();
  const Checkpoint saved = read_checkpoint(file);
  SceneRequest request = request_;
  complete(request, saved);
  LoadedScene fresh = load(request, environment_, registry_);
  std::vector<Settings> loaded = settings_of(fresh);
  resume_all(fresh, request, saved, file, registry_);
  loaded_ = std::move(loaded);
  request_ = std::move(request);
  scene_ = std::move(fresh);
  timelines_.clear();
  for (std::size_t i = 0; i < scene_.systems.size(); ++i) {
    timelines_.emplace_back(scene_.systems[i], budget_);
    timelines_.back().set_start(saved.systems[i].start_energy);
    ledger_.keep(i, scene_.systems[i], saved.systems[i].work);
  }
  branches_.clear();
  branch_ = "main";
  share_budget();
}

}  // namespace sim::cli
