// The scene behind a prompt: its settings, its file, its branches and its checkpoints.
#include <algorithm>
#include <iostream>

#include "cli/prompt/repl_scene.h"
#include "cli/run/checkpoint_file.h"
#include "cli/terminal/signals.h"
#include "core/base/error.h"
#include "core/base/text.h"

namespace sim::cli {
namespace {

bool no_signal() { return !SessionSignals::any(); }

[[noreturn]] void refuse(const std::string& what, const std::string& why,
                         const std::string& remedy) {
  throw Error(ErrorKind::kUsage, {what, "", why, remedy});
}

}  // namespace

std::size_t SceneOrigin::first_choice() const {
  for (std::size_t i = 0; i < scene.systems.size(); ++i)
    if (scene.systems[i].second_order()) return i;
  return 0;
}

std::shared_ptr<SceneOrigin> read_origin(const SceneRequest& request,
                                         const Environment& environment, Registry& registry) {
  auto origin = std::make_shared<SceneOrigin>();
  origin->request = request;
  origin->scene = load(request, environment, registry);
  for (const Simulation& each : origin->scene.systems) origin->loaded.push_back(each.settings());
  return origin;
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
  act({.what = Action::What::kIntegrator, .name = method->label(), .method = method});
}

void LiveScene::set_dt(double h) { act({.what = Action::What::kDt, .value = h}); }

void LiveScene::apply_choices(LoadedScene& scene) const {
  for (Simulation& each : scene.systems)
    for (std::size_t i = 0; i < origin_->loaded.size(); ++i) {
      const Simulation& old = origin_->scene.systems[i];
      if (old.name() != each.name() && origin_->scene.spec.world) continue;
      const Settings &chosen = old.settings(), &given = origin_->loaded[i];
      if (chosen.method.choice() != given.method.choice()) each.set_integrator(chosen.method);
      if (chosen.h != given.h) each.set_dt(chosen.h);
    }
}

std::vector<Change> LiveScene::reload(
    const std::optional<std::pair<std::string, std::string>>& setting) {
  check_idle();
  check_one_way();
  SceneRequest request = origin_->request;
  if (setting) request.settings[setting->first] = setting->second;
  const auto fresh = read_origin(request, environment_, registry_);
  std::vector<Simulation>& systems = fresh->scene.systems;
  apply_choices(fresh->scene);
  std::vector<Timeline> timelines;
  std::vector<std::int64_t> targets;
  for (const Simulation& each : systems) {
    const auto old = std::ranges::find(origin_->scene.systems, each.name(), &Simulation::name);
    const double t =
        old == origin_->scene.systems.end() ? origin_->scene.systems.front().t() : old->t();
    timelines.emplace_back(each, budget_ / systems.size());
    targets.push_back(timelines.back().step_at(each, t));
  }
  advance(fresh->scene, timelines, targets);

  std::vector<Change> changes = differences(origin_->scene, fresh->scene);
  int edits = 0;
  for (const Timeline& timeline : timelines_) edits += timeline.edits();
  if (edits > 0)
    changes.push_back(
        {"changes by hand", std::to_string(edits), "only integrator and dt, from the start"});
  adopt(fresh);
  timelines_ = std::move(timelines);
  share_budget();
  return changes;
}

// Its system of the same name remains the present one.
void LiveScene::adopt(std::shared_ptr<SceneOrigin> origin) {
  const std::string name = system().name();
  origin_ = std::move(origin);
  current_ = origin_->first_choice();
  timelines_.clear();
  for (std::size_t i = 0; i < origin_->scene.systems.size(); ++i) {
    timelines_.emplace_back(origin_->scene.systems[i], budget_);
    if (origin_->scene.systems[i].name() == name) current_ = i;
  }
  share_budget();
}

void LiveScene::open(const std::string& scene) {
  check_idle();
  check_one_way();
  SceneRequest request;
  request.scene = scene;
  request.seed = origin_->request.seed;
  request.threads = origin_->request.threads;
  const auto fresh = read_origin(request, environment_, registry_);
  adopt(fresh);
  judged_.reset();
}

// --- Branches ---------------------------------------------------------------------------------

LiveScene::Branch LiveScene::present() {
  Branch branch;
  branch.origin = origin_;
  for (std::size_t i = 0; i < timelines_.size(); ++i) {
    timelines_[i].keep(origin_->scene.systems[i]);
    branch.steps.push_back(origin_->scene.systems[i].step_count());
  }
  branch.timelines = timelines_;
  branch.t = origin_->scene.systems.front().t();
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
  refuse("unknown branch '" + name + "'", "there is no branch of that name",
         suggestion(name, known));
}

void LiveScene::add_branch(const std::string& name) {
  check_idle();
  if (name == branch_ || branches_.contains(name))
    refuse("branch '" + name + "' exists", "two cannot have one name",
           ".switch " + name + " goes there");
  branches_.emplace(name, present());
  share_budget();
}

void LiveScene::switch_to(const std::string& name) {
  check_idle();
  check_one_way();
  const Branch there = branch_named(name);
  branches_[branch_] = present();
  branches_.erase(name);
  branch_ = name;
  if (origin_ != there.origin) {
    origin_ = there.origin;
    current_ = origin_->first_choice();
  }
  timelines_ = there.timelines;
  for (std::size_t i = 0; i < timelines_.size(); ++i)
    timelines_[i].enter(origin_->scene.systems[i], there.steps[i], no_signal);
  share_budget();
  SessionSignals::check();
}

std::optional<FirstDifference> LiveScene::diff(const std::string& a, const std::string& b) {
  Branch left = branch_named(a), right = branch_named(b);
  const LoadedScene &ours = left.origin->scene, &theirs = right.origin->scene;
  const auto alike = [](const Simulation& one, const Simulation& other) {
    return one.name() == other.name() && one.state().size() == other.state().size() &&
           one.second_order() == other.second_order() && one.particles() == other.particles();
  };
  if (!std::ranges::equal(ours.systems, theirs.systems, alike))
    refuse("cannot compare " + a + " and " + b, "their scenes have other systems or sizes",
           ".set shows the parameters of a branch");
  std::optional<FirstDifference> first;
  for (std::size_t i = 0; i < ours.systems.size(); ++i) {
    const SystemSpec& spec = ours.spec.systems[i];
    const RunOptions options{.threads = origin_->request.threads};
    Simulation one(spec, registry_, options);
    Simulation other(theirs.spec.systems[i], registry_, options);
    Timeline &here = left.timelines[i], &there = right.timelines[i];
    const std::int64_t end = std::min(left.steps[i], right.steps[i]);
    const std::int64_t common = here.common(there);
    std::int64_t step = std::min(end, std::max({common, here.first(), there.first()}));
    here.enter(one, step, no_signal);
    there.enter(other, step, no_signal);
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
    const std::vector<double>* const known = ledger_.find(i, origin_->scene.systems[i]);
    accounts.push_back({start_energy(i), known ? *known : std::vector<double>(), origin_->doubt});
  }
  save_checkpoint(file, origin_->request, origin_->scene, accounts, std::cout);
}

void LiveScene::resume(const std::string& file) {
  check_idle();
  check_one_way();
  const Checkpoint saved = read_checkpoint(file);
  SceneRequest request = origin_->request;
  complete(request, saved);
  const auto fresh = read_origin(request, environment_, registry_);
  const std::vector<Account> accounts = resume_all(fresh->scene, request, saved, file, registry_);
  fresh->doubt = accounts.front().doubt;
  adopt(fresh);
  for (std::size_t i = 0; i < origin_->scene.systems.size(); ++i) {
    timelines_[i].set_start(accounts[i].start_energy);
    ledger_.keep(i, origin_->scene.systems[i], accounts[i].work);
  }
}

}  // namespace sim::cli
