#include "cli/view/live.h"

#include <algorithm>
#include <cmath>

#include "cli/run/judged.h"
#include "cli/run/recorder.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/report/replays.h"
#include "core/report/summary.h"

namespace sim::cli {
namespace {

constexpr double kPreview = 0.06;  // s of work for a look ahead
constexpr int kPreviewMoments = 12;
constexpr double kApart = 20;         // of its size, or of a metre: too far to be looked at
constexpr double kLongestDebt = 0.1;  // s behind the clock, more is never caught up
constexpr double kHandRate = 60;      // moves a second
constexpr double kMeasured = 0.5;     // s between two measurements of the speed
constexpr double kSpare = 0.1;  // of real time: steps that leave room for those of half the size
constexpr int kFew = 20000;     // particles
constexpr std::size_t kMostHands = 32;

// The largest coordinate of anything, m.
double reach(const Moment& moment) {
  double most = 0;
  for (const Frame& frame : moment)
    for (const double x : frame.x) most = std::max(most, std::isfinite(x) ? std::abs(x) : HUGE_VAL);
  return most;
}

// The moments of a run of the scene from its start, as far as a short time allows, and until it
// flies apart.
std::vector<Moment> preview_of(const LoadedScene& scene, const SceneRequest& request,
                               Registry& registry) {
  std::vector<Simulation> systems;
  for (const SystemSpec& spec : scene.spec.systems)
    systems.emplace_back(spec, registry, run_options(request, spec, registry));
  std::vector<Moment> moments;
  const Stopwatch watch;
  for (int i = 0; i <= kPreviewMoments && watch.seconds() < kPreview; ++i) {
    Moment moment;
    for (Simulation& system : systems) {
      const double until = std::max(system.duration(), system.h()) * i / kPreviewMoments;
      while (system.t() < until && watch.seconds() < kPreview)
        if (system.steps(8) == 0) break;
      moment.push_back(take_frame(system));
    }
    if (!moments.empty() && reach(moment) > kApart * std::max(reach(moments.front()), 1.0)) break;
    moments.push_back(std::move(moment));
  }
  return moments;
}

}  // namespace

Live::Live(LoadedScene& scene, const SceneRequest& request, Registry& registry, int number,
           std::vector<Timeline> timelines)
    : scene_(scene),
      registry_(registry),
      number_(number),
      player_(timelines.empty() ? Player(scene.systems, scene.spec.world)
                                : Player(scene.systems, scene.spec.world, std::move(timelines))),
      preview_(preview_of(scene, request, registry)),
      measured_(scene, registry),
      shares_(scene.systems.size(), std::nan("")) {
  for (std::size_t i = 0; i < scene.systems.size(); ++i) {
    models_.push_back(make_model(scene.spec.systems[i], scene.systems[i]));
    accounts_.emplace_back(player_, i, scene_.spec.systems[i], registry_);
    before_.push_back(player_.timeline(i).actions());
    player_.before_touch(i, [this, i] {
      accounts_[i].look();
      measured_.before_touch(i);
    });
  }
  measure_limits();
  measured_.afford(few());
  if (player_.step() > 0) preview_.push_back(moment());
}

// True if the scene is so small that a second run beside it is cheap.
bool Live::few() const {
  int particles = 0;
  for (const Model& model : models_) particles += model.particles;
  return particles < kFew;
}

ViewScene Live::scene() const {
  ViewScene scene{.number = number_, .world = scene_.spec.world, .models = models_};
  scene.preview = preview_;
  scene.look = look_of(scene_.spec, {});
  scene.methods = registry_.names<Integrator>();
  scene.args = scene_.spec.args;
  return scene;
}

// --- Time -------------------------------------------------------------------------------------

void Live::run(double seconds) {
  const double passed = std::min(since_last_.seconds(), 1.0);
  since_last_ = {};
  travel([&] { return since_last_.seconds() < seconds; });
  if (!playing_ || player_.failed() >= 0) {
    debt_ = 0;
    return;
  }
  const double longest = kLongestDebt * speed_;
  debt_ += passed * speed_;
  move_hands();
  const double start = player_.system().t();
  const Stopwatch watch;
  bool slow = false;
  while (debt_ > 0 && player_.failed() < 0) {
    const double h = player_.system().h(), before = player_.system().t();
    // No more steps than there is time for, and half of that: they may take longer than the last
    // ones.
    const double left = seconds - watch.seconds();
    const double fit = step_cost_ > 0 ? std::min(64.0, left / step_cost_ / 2) : 64.0;
    const auto most = static_cast<std::int64_t>(std::clamp(debt_ / h, 1.0, std::max(1.0, fit)));
    const Stopwatch of_steps;
    const std::int64_t steps = player_.advance(std::min(most, accounts_.front().due()));
    if (steps == 0) {
      fail_as_player();
      break;
    }
    taken_ += steps;
    fresh_ = true;
    step_cost_ = of_steps.seconds() / static_cast<double>(steps);
    debt_ -= player_.system().t() - before;
    for (EnergyAccount& each : accounts_) each.stepped();
    if (watch.seconds() > seconds) {
      slow = debt_ > 0;
      break;
    }
  }
  stop_explosion();
  debt_ = std::min(debt_, longest);
  spent_ += watch.seconds();
  wall_ += passed;
  simulated_ += player_.system().t() - start;
  if (wall_ > kMeasured) {
    us_ = taken_ > 0 ? 1e6 * spent_ / static_cast<double>(taken_) : us_;
    real_ = simulated_ / wall_;
    // Measurements nobody asked for stop until a reset if they cost too much.
    if (step_cost_ * speed_ > kSpare * player_.system().h()) measured_.afford(false);
    was_slow_ = slow;
    spent_ = wall_ = simulated_ = 0;
    taken_ = 0;
  }
}

// Finite numbers may still be useless: returns to the last good state.
void Live::stop_explosion() {
  for (std::size_t i = 0; i < accounts_.size() && failure_.empty(); ++i) {
    accounts_[i].sample();
    const std::int64_t good = accounts_[i].last_good();
    if (good < 0) continue;
    const Simulation& system = player_.system(i);
    const std::string text = "diverged: the energy of " + system.name() +
                             " rose a million times by t = " + brief(system.t()) + " s";
    go_to(i == 0 ? good : player_.step_at(system.t(good)));
    fail(i, text + limit_words(i));
  }
}

std::string Live::limit_words(std::size_t i) {
  if (shares_stale_) measure_limits();
  if (!(shares_[i] > 1)) return ". This is a state before.";
  constexpr double kMany = 10;
  return "; dt is " +
         (shares_[i] < kMany ? brief(100 * shares_[i], 3) + " % of"
                             : brief(shares_[i], 3) + " times") +
         " the largest stable step: try dt " + brief(0.8 * player_.system(i).h() / shares_[i], 2) +
         ". This is a state before.";
}

void Live::go_to(std::int64_t step) {
  player_.go_to(step);
  measured_.begin_anew();
  settle();
}

// Steps on to the target of a command, until it is reached or has to stop for now.
void Live::travel(const std::function<bool()>& go_on) {
  if (!travel_) return;
  fresh_ = true;
  bool more = true;
  if (travel_->known) {
    player_.go_to(travel_->to, [&] { return more = go_on(); });
    if (!more) return;
    measured_.begin_anew();
    settle();
  } else {
    while (player_.step() < travel_->to && (more = go_on()) &&
           player_.advance(std::min<std::int64_t>(8, travel_->to - player_.step())) > 0)
      for (EnergyAccount& each : accounts_) each.stepped();
    if (!more) return;
    if (player_.failed() >= 0) fail_as_player();
  }
  travel_.reset();
}

void Live::settle() {
  for (EnergyAccount& each : accounts_) each.stepped();
  debt_ = 0;
}

void Live::begin_anew() {
  failure_.clear();
  settle();
}

void Live::fail(std::size_t system, std::string words) {
  failure_ = std::move(words);
  failed_ = system;
  playing_ = false;
}

void Live::measure_limits() {
  constexpr double kLeast = 1, kTimes = 50;  // s, times its cost: until the next sample
  shares_stale_ = false;
  const Stopwatch watch;
  for (std::size_t i = 0; i < shares_.size(); ++i) shares_[i] = stable_share(player_.system(i));
  limits_hold_ = std::max(kLeast, kTimes * watch.seconds());
  since_limits_ = {};
}

// The same words as for a run.
void Live::fail_as_player() {
  const auto i = static_cast<std::size_t>(std::max(0, player_.failed()));
  Simulation& system = player_.system(i);
  Track track(scene_.spec.systems[i], system, system.step_count(), Track::kNever, Track::kNever);
  track.mark_diverged();
  fail(i, "diverged: " + track.verdict().reason + limit_words(i));
}

// --- Hands ------------------------------------------------------------------------------------

void Live::perform(std::size_t system, const Action& action) {
  measured_.before_touch(system);
  player_.act(system, action);
  measured_.touched(system, action);
}

// Moves held particles to the pointer, on a line until the next position of the pointer.
void Live::move_hands() {
  for (Hand& hand : hands_) {
    if (!hand.pulled) continue;
    hand.pulled = false;
    const double steps = speed_ / kHandRate / player_.system(hand.system).h();
    Action move{.what = Action::What::kMove, .particle = hand.particle, .x = hand.to};
    move.steps = static_cast<std::int64_t>(std::clamp(std::round(steps), 1.0, 1e6));
    perform(hand.system, move);
  }
  for (EnergyAccount& each : accounts_) each.stepped();
}

void Live::let_go(std::uint64_t from) {
  for (std::size_t i = 0; i < hands_.size();) {
    if (hands_[i].from != from) {
      ++i;
      continue;
    }
    const Hand hand = hands_[i];
    hands_.erase(hands_.begin() + static_cast<std::ptrdiff_t>(i));
    const Action release{.what = Action::What::kRelease, .particle = hand.particle};
    perform(hand.system, release);
  }
  settle();
}

void Live::act(std::uint64_t from, std::size_t system, Action action) {
  if (action.what == Action::What::kReset)
    throw Error(ErrorKind::kUsage, {"bad action", "", "a reset is of all systems", ""});
  if (action.what == Action::What::kIntegrator)
    action.method = report::method_of(action, registry_);
  const auto same = [&](const Hand& each) {
    return each.system == system && each.particle == action.particle;
  };
  const bool grabs = action.what == Action::What::kGrab;
  if (grabs && hands_.size() >= kMostHands)
    throw Error(ErrorKind::kUsage, {"no hand is free", "", "32 hold something", ""});
  const bool held = std::ranges::any_of(hands_, same);
  if (grabs || hands_.empty()) player_.part();
  before_[system] = std::min(before_[system], player_.timeline(system).actions());
  perform(system, action);
  if (grabs && !held) hands_.push_back({system, action.particle, from});
  const bool releases = action.what == Action::What::kRelease;
  if (releases) std::erase_if(hands_, same);
  releases ? settle() : begin_anew();
  if (action.what == Action::What::kDt || action.what == Action::What::kIntegrator) {
    accounts_[system].travelled();
    goal_ = {.number = goal_.number};  // another choice than that for an error
  }
  const bool pins = action.what == Action::What::kPin || action.what == Action::What::kUnpin;
  shares_stale_ |= action.changes_settings() && !pins;
}

// --- What is shown ----------------------------------------------------------------------------

Moment Live::moment() {
  Moment moment;
  for (const Simulation& each : scene_.systems) moment.push_back(take_frame(each));
  measured_.fill(moment, models_);
  return moment;
}

// The verdict of a run that ends here, without checks that only a complete run allows: whether
// positions that differ with half the step do so by the step or by chaos.
std::string Live::verdict(std::size_t i) {
  if (!failure_.empty() && failed_ == i) return failure_;
  constexpr double kWrong = 0.02;  // of the size, as in a verdict
  const study::RunDeviation parted = measured_.parted(i);
  const bool right = parted.verified() && parted.share <= kWrong;
  study::Verdict verdict = accounts_[i].verdict(right ? parted : study::RunDeviation());
  if (parted.verified() && !right) {
    verdict.trust = std::max(verdict.trust, study::Trust::kSuspect);
    verdict.reason =
        "positions differ by up to " + brief(parted.error, 2) +
        " m from those with half the step: dt is too long, or the motion is chaotic; " +
        verdict.reason;
  } else if (!right && player_.step() > 0) {
    verdict.trust = std::max(verdict.trust, study::Trust::kUnverified);
    verdict.reason += "; positions not verified: half the step is too slow here";
  }
  return std::string(study::trust_name(verdict.trust)) + ": " + verdict.reason;
}

ViewState Live::state() {
  fresh_ = false;
  if (shares_stale_ || (playing_ && since_limits_.seconds() > limits_hold_)) measure_limits();
  ViewState all{.number = number_, .playing = playing_, .slow = was_slow_};
  all.speed = speed_;
  all.real = real_;
  all.us = us_;
  all.known = player_.system().t(player_.known());
  all.failure = failure_;
  all.measured = measured_.name();
  for (std::size_t i = 0; i < player_.count(); ++i) {
    Simulation& system = player_.system(i);
    ViewSystem each{.now = accounts_[i].sample(), .h = system.h(), .share = shares_[i]};
    each.method = system.method().label();
    each.verdict = verdict(i);
    each.pinned = system.settings().pinned;
    each.held = system.settings().held;
    each.switches = system.switches();
    if (!playing_) each.hash = hash_text(system);
    all.systems.push_back(std::move(each));
  }
  std::size_t shown = 0;
  while (shown + 1 < models_.size() && !models_[shown].second_order) ++shown;
  all.past = accounts_[shown].samples();
  all.goal = {!all_, goal_.busy, goal_.asked, goal_.words};
  return all;
}

}  // namespace sim::cli
