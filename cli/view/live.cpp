#include "cli/view/live.h"

#include <algorithm>
#include <cmath>

#include "cli/run/recorder.h"
#include "cli/run/replay_file.h"
#include "cli/run/summary.h"
#include "cli/run/track.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"

namespace sim::cli {
namespace {

constexpr double kPreview = 0.06;  // s of work to see what is to come
constexpr int kPreviewMoments = 12;
constexpr double kLongestDebt = 0.1;  // s behind the clock, more is never caught up
constexpr double kHandRate = 60;      // moves a second
constexpr double kMeasured = 0.5;     // s between two measurements of the speed
constexpr std::size_t kMostHands = 32;

double seconds_since(std::chrono::steady_clock::time_point then) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - then).count();
}

[[noreturn]] void refuse_word(const std::string& what, const std::string& why) {
  throw Error(ErrorKind::kUsage, {what, "", why, ""});
}

double number_in(const std::string& text, double least, double most) {
  const auto value = parse_number(text);
  if (!value || !(*value >= least && *value <= most))
    refuse_word("bad number '" + text.substr(0, 40) + "'",
                "expected one from " + brief(least) + " to " + brief(most));
  return *value;
}

// The moments of a run of the scene from its start, as far as a little time goes.
std::vector<Moment> preview_of(const LoadedScene& scene, const SceneRequest& request,
                               Registry& registry) {
  std::vector<Simulation> systems;
  for (const SystemSpec& spec : scene.spec.systems)
    systems.emplace_back(spec, registry, run_options(request, spec, registry));
  std::vector<Moment> moments;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i <= kPreviewMoments && seconds_since(begin) < kPreview; ++i) {
    Moment moment;
    for (Simulation& system : systems) {
      const double until = std::max(system.duration(), system.h()) * i / kPreviewMoments;
      while (system.t() < until && seconds_since(begin) < kPreview)
        if (system.steps(8) == 0) break;
      moment.push_back(take_frame(system));
    }
    moments.push_back(std::move(moment));
  }
  return moments;
}

std::string json_numbers(const std::vector<double>& values, int digits) {
  std::vector<std::string> texts;
  for (const double value : values)
    texts.push_back(std::isfinite(value) ? brief(value, digits) : "null");
  return json_array(texts);
}

std::string json_ids(const std::vector<int>& ids) {
  std::vector<std::string> texts;
  for (const int id : ids) texts.push_back(std::to_string(id));
  return json_array(texts);
}

}  // namespace

Live::Live(LoadedScene& scene, const SceneRequest& request, Registry& registry, int number)
    : scene_(scene),
      registry_(registry),
      number_(number),
      player_(scene.systems, scene.spec.world),
      preview_(preview_of(scene, request, registry)),
      shares_(scene.systems.size(), std::nan("")),
      last_(Clock::now()) {
  for (std::size_t i = 0; i < scene.systems.size(); ++i) {
    models_.push_back(make_model(scene.spec.systems[i], scene.systems[i]));
    accounts_.emplace_back(player_, i);
    player_.before_touch(i, [this, i] { accounts_[i].look(); });
  }
  page_ = std::make_unique<Page>(models_, preview_, look_of(scene.spec, {}));
  measure_limits();
}

std::string Live::page(bool pause_hidden) const {
  std::vector<std::string> methods, switches;
  for (const std::string& name : registry_.names<Integrator>())
    methods.push_back(json_string(name));
  JsonObject live;
  live.text("socket", "@SOCKET@").json("methods", json_array(methods));
  live.flag("world", scene_.spec.world).integer("page", number_);
  live.flag("pauseHidden", pause_hidden);
  live.json("args", args_json(scene_.spec.args));
  return page_->of_live(live.str());
}

// --- Time -------------------------------------------------------------------------------------

void Live::run(double seconds) {
  const double passed = std::min(seconds_since(last_), 1.0);
  last_ = Clock::now();
  if (!playing_ || player_.failed() >= 0) {
    debt_ = 0;
    return;
  }
  const double longest = kLongestDebt * speed_;
  debt_ += passed * speed_;
  move_hands();
  const double start = player_.system().t();
  const auto begin = Clock::now();
  bool slow = false;
  while (debt_ > 0 && player_.failed() < 0) {
    const double h = player_.system().h(), before = player_.system().t();
    // No more than there is time for.
    const double left = seconds - seconds_since(begin);
    const double fit = step_cost_ > 0 ? std::min(64.0, left / step_cost_) : 64.0;
    const auto most = static_cast<std::int64_t>(std::clamp(debt_ / h, 1.0, std::max(1.0, fit)));
    const auto start_of_steps = Clock::now();
    const std::int64_t steps = player_.advance(std::min(most, accounts_.front().due()));
    if (steps == 0) {
      failure_ = failure();
      playing_ = false;
      break;
    }
    taken_ += steps;
    fresh_ = true;
    step_cost_ = seconds_since(start_of_steps) / static_cast<double>(steps);
    debt_ -= player_.system().t() - before;
    for (EnergyAccount& each : accounts_) each.stepped();
    if (seconds_since(begin) > seconds) {
      slow = debt_ > 0;
      break;
    }
  }
  stop_explosion();
  debt_ = std::min(debt_, longest);
  spent_ += seconds_since(begin);
  wall_ += passed;
  simulated_ += player_.system().t() - start;
  if (wall_ > kMeasured) {
    us_ = taken_ > 0 ? 1e6 * spent_ / static_cast<double>(taken_) : us_;
    real_ = simulated_ / wall_;
    was_slow_ = slow;
    spent_ = wall_ = simulated_ = 0;
    taken_ = 0;
  }
}

// Numbers that are still finite may be of no use: back to where they were.
void Live::stop_explosion() {
  for (std::size_t i = 0; i < accounts_.size() && failure_.empty(); ++i) {
    accounts_[i].sample();
    const std::int64_t good = accounts_[i].last_good();
    if (good < 0) continue;
    const Simulation& system = player_.system(i);
    const std::string text = "diverged: the energy of " + system.name() +
                             " rose a million times by t = " + brief(system.t()) + " s";
    playing_ = false;
    go_to(i == 0 ? good : player_.step_at(system.t(good)));
    failure_ = text + limit_words(i);
  }
}

std::string Live::limit_words(std::size_t i) {
  if (!(shares_[i] > 1)) return ". This is a state before.";
  return "; dt is " + brief(100 * shares_[i], 3) + " % of the largest stable step: try dt " +
         brief(0.8 * player_.system(i).h() / shares_[i], 2) + ". This is a state before.";
}

void Live::go_to(std::int64_t step) {
  player_.go_to(step);
  settle();
}

void Live::settle() {
  for (EnergyAccount& each : accounts_) each.stepped();
  failure_.clear();
  debt_ = 0;
}

void Live::measure_limits() {
  constexpr double kLeast = 1, kTimes = 50;  // s, of what it costs: until the next look
  const auto begin = Clock::now();
  for (std::size_t i = 0; i < shares_.size(); ++i) shares_[i] = stable_share(player_.system(i));
  limits_ = Clock::now() +
            std::chrono::duration_cast<Clock::duration>(
                std::chrono::duration<double>(std::max(kLeast, kTimes * seconds_since(begin))));
}

// In the words of a run.
std::string Live::failure() {
  const auto i = static_cast<std::size_t>(std::max(0, player_.failed()));
  Simulation& system = player_.system(i);
  Track track(scene_.spec.systems[i], system, system.step_count(), Track::kNever, Track::kNever);
  track.mark_diverged();
  return "diverged: " + track.verdict().reason + limit_words(i);
}

// --- Hands ------------------------------------------------------------------------------------

// What is held goes to where the pointer is, along a line until the next look at the pointer.
void Live::move_hands() {
  for (Hand& hand : hands_) {
    if (!hand.pulled) continue;
    hand.pulled = false;
    const double steps = speed_ / kHandRate / player_.system(hand.system).h();
    Action move{.what = Action::What::kMove, .particle = hand.particle, .x = hand.to};
    move.steps = static_cast<std::int64_t>(std::clamp(std::round(steps), 1.0, 1e6));
    player_.act(hand.system, move);
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
    player_.act(hand.system, {.what = Action::What::kRelease, .particle = hand.particle});
  }
  settle();
}

void Live::act(std::uint64_t from, std::size_t system, Action action) {
  if (action.what == Action::What::kReset) refuse_word("bad action", "a reset is of all systems");
  if (action.what == Action::What::kIntegrator) action.method = method_of(action, registry_);
  const auto same = [&](const Hand& each) {
    return each.system == system && each.particle == action.particle;
  };
  const bool grabs = action.what == Action::What::kGrab;
  if (grabs && hands_.size() >= kMostHands) refuse_word("no hand is free", "32 hold something");
  const bool held = std::ranges::any_of(hands_, same);
  if (grabs || hands_.empty()) player_.part();
  player_.act(system, action);
  if (grabs && !held) hands_.push_back({system, action.particle, from});
  if (action.what == Action::What::kRelease) std::erase_if(hands_, same);
  settle();
  const bool pins = action.what == Action::What::kPin || action.what == Action::What::kUnpin;
  if (action.changes_settings() && !pins) measure_limits();
}

// --- What is said -----------------------------------------------------------------------------

std::string Live::take(std::uint64_t from, const std::string& line) {
  fresh_ = true;
  try {
    return obey(from, line);
  } catch (const Error& error) {
    return JsonObject().text("error", error.what()).str();
  }
}

// The first word, which leaves the line.
std::string Live::word_of(std::string& line) {
  const std::size_t end = std::min(line.find(' '), line.size());
  std::string word = line.substr(0, end);
  line.erase(0, std::min(end + 1, line.size()));
  return word;
}

std::string Live::obey(std::uint64_t from, const std::string& line) {
  if (line == "hello") return strip();
  std::string rest = line;
  std::size_t system = 0;
  if (const std::size_t colon = rest.find(": "); colon < rest.find(' ')) {
    const auto names = scene_.names();
    const auto named = std::ranges::find(names, rest.substr(0, colon));
    if (named == names.end()) refuse_word("no such system", "'" + rest.substr(0, 40) + "'");
    system = static_cast<std::size_t>(named - names.begin());
    rest.erase(0, colon + 2);
  }
  std::string arguments = rest;
  const std::string word = word_of(arguments);
  if (word == "pull") {
    pull_to(system, arguments);
  } else if (word == "set") {
    const std::string name = word_of(arguments);
    wish_ = Wish{from, name, arguments};
  } else if (!control(word, arguments, from)) {
    const Action action = parse_action(rest);
    // The method is what panels differ in.
    const bool each = all_ && action.what != Action::What::kIntegrator;
    for (std::size_t i = each ? 0 : system; i < (each ? player_.count() : system + 1); ++i)
      act(from, i, action);
  }
  return "";
}

void Live::pull_to(std::size_t system, std::string arguments) {
  const int particle = static_cast<int>(number_in(word_of(arguments), 0, 2e9));
  Vec3 point;
  for (std::size_t axis = 0; axis < 3; ++axis)
    point[axis] = number_in(word_of(arguments), -1e6, 1e6);
  pull(system, particle, page_->metres(system, point));
}

void Live::pull(std::size_t system, int particle, const Vec3& to) {
  bool any = false;
  for (Hand& hand : hands_)
    if ((all_ || hand.system == system) && hand.particle == particle) {
      hand.to = to;
      hand.pulled = any = true;
    }
  if (any) return;
  refuse_word("nothing to pull", "particle " + std::to_string(particle) + " is not held");
}

// What changes no state but where in time it is looked at; false for another word.
bool Live::control(const std::string& word, const std::string& argument, std::uint64_t from) {
  constexpr double kFurthest = 1e6, kFastest = 100;
  if (word == "play") {
    playing_ = player_.failed() < 0;
    if (playing_) failure_.clear();
  } else if (word == "pause") {
    playing_ = false;
  } else if (word == "speed") {
    speed_ = number_in(argument, 0.001, kFastest);
  } else if (word == "step") {
    playing_ = false;
    move_hands();
    const auto target = player_.step() + static_cast<std::int64_t>(number_in(argument, 1, 1000));
    while (player_.step() < target && player_.advance(target - player_.step()) > 0)
      for (EnergyAccount& each : accounts_) each.stepped();
    if (player_.failed() >= 0) failure_ = failure();
  } else if (word == "back") {
    playing_ = false;
    go_to(player_.step() - static_cast<std::int64_t>(number_in(argument, 1, kFurthest)));
  } else if (word == "goto") {
    playing_ = false;
    go_to(player_.step_at(number_in(argument, 0, 1e9)));
  } else if (word == "undo") {
    hands_.clear();
    if (!player_.undo()) refuse_word("nothing to undo", "no hand has done anything");
    settle();
    measure_limits();
  } else if (word == "reset") {
    hands_.clear();
    player_.reset();
    accounts_.clear();
    for (std::size_t i = 0; i < player_.count(); ++i) accounts_.emplace_back(player_, i);
    settle();
  } else if (word == "bye") {
    let_go(from);
  } else {
    return false;
  }
  return true;
}

// --- What is shown ----------------------------------------------------------------------------

std::string Live::words() {
  if (playing_ && Clock::now() > limits_) measure_limits();
  std::vector<std::string> systems;
  for (std::size_t i = 0; i < player_.count(); ++i) {
    Simulation& system = player_.system(i);
    const EnergySample now = accounts_[i].sample();
    JsonObject each;
    each.integer("step", now.step).number("t", now.t).number("h", system.h());
    each.text("method", system.method().label());
    each.number("share", shares_[i]).number("kinetic", now.kinetic);
    each.number("potential", now.potential).number("drift", now.drift);
    each.json("pinned", json_ids(system.settings().pinned));
    each.json("held", json_ids(system.settings().held));
    each.text("verdict", live_verdict(now, accounts_[i].samples(), shares_[i], system));
    JsonObject switches;
    for (const auto& [name, on] : system.switches()) switches.flag(name, on);
    each.json("switches", switches.str());
    if (!playing_) each.text("hash", hash_text(system));
    systems.push_back(each.str());
  }
  JsonObject all;
  all.integer("page", number_)
      .flag("playing", playing_)
      .number("speed", speed_)
      .number("real", real_)
      .number("us", us_);
  all.flag("slow", was_slow_).number("known", player_.system().t(player_.known()));
  all.text("failure", failure_).json("systems", json_array(systems));
  return all.str();
}

Moment Live::moment() const {
  Moment moment;
  for (const Simulation& each : scene_.systems) moment.push_back(take_frame(each));
  return moment;
}

std::string Live::verdict(std::size_t i) {
  if (!failure_.empty()) return failure_;
  return live_verdict(accounts_[i].sample(), accounts_[i].samples(), shares_[i], player_.system(i));
}

std::string Live::frame() {
  fresh_ = false;
  const Moment now = moment();
  std::string text = words();
  std::vector<std::string> solids;
  for (std::size_t i = 0; i < now.size(); ++i) solids.push_back(page_->solids(now, i));
  text.pop_back();
  text += ",\"solids\":" + json_array(solids) + "}";
  return page_->frame(now, text);
}

std::string Live::strip() const {
  std::vector<double> t, kinetic, potential;
  std::size_t shown = 0;
  while (shown + 1 < models_.size() && !models_[shown].second_order) ++shown;
  const std::vector<EnergySample>& past = accounts_[shown].samples();
  const std::size_t every = past.size() / 500 + 1;
  for (std::size_t i = 0; i < past.size(); i += every) {
    t.push_back(past[i].t);
    kinetic.push_back(past[i].kinetic);
    potential.push_back(past[i].potential);
  }
  return JsonObject()
      .json("t", json_numbers(t, 7))
      .json("kinetic", json_numbers(kinetic, 5))
      .json("potential", json_numbers(potential, 5))
      .str();
}

}  // namespace sim::cli
