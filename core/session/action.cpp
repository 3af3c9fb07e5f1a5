#include "core/session/action.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/base/utf8.h"

namespace sim {
namespace {

using What = Action::What;

constexpr std::int64_t kMostMoveSteps = 1'000'000'000;

// The grammar of each action; i a particle, x three numbers, n steps, s a switch, v a number, m the
// name of a method.
struct Grammar {
  What what;
  const char* word;
  const char* rest;
  const char* usage;
};
constexpr std::array<Grammar, 13> kGrammar{{
    {What::kGrab, "grab", "i", "grab PARTICLE"},
    {What::kMove, "move", "ixn", "move PARTICLE X Y Z over STEPS"},
    {What::kRelease, "release", "i", "release PARTICLE"},
    {What::kPin, "pin", "i", "pin PARTICLE"},
    {What::kUnpin, "unpin", "i", "unpin PARTICLE"},
    {What::kCut, "cut", "ij", "cut PARTICLE PARTICLE"},
    {What::kSwitch, "switch", "s", "switch NAME on|off"},
    {What::kDt, "dt", "v", "dt SECONDS"},
    {What::kIntegrator, "integrator", "m", "integrator NAME"},
    {What::kPosition, "position", "ix", "position PARTICLE X Y Z"},
    {What::kVelocity, "velocity", "ix", "velocity PARTICLE VX VY VZ"},
    {What::kComponent, "component", "iv", "component I VALUE"},
    {What::kReset, "reset", "", "reset"},
}};

const Grammar& grammar_of(What what) { return *std::ranges::find(kGrammar, what, &Grammar::what); }

std::vector<std::string> split_words(std::string_view text) {
  std::vector<std::string> words;
  std::string word;
  for (const char c : text) {
    if (c != ' ' && c != '\t') {
      word += c;
    } else if (!word.empty()) {
      words.push_back(std::move(word));
      word.clear();
    }
  }
  if (!word.empty()) words.push_back(word);
  return words;
}

[[noreturn]] void refuse_action(std::string_view text, const std::string& why,
                                const std::string& remedy) {
  constexpr std::size_t kShown = 80;
  throw Error(ErrorKind::kUsage,
              {"bad action", "'" + std::string(utf8_head(text, kShown)) + "'", why, remedy});
}

class ActionReader {
 public:
  ActionReader(std::string_view text, const Grammar& grammar, std::vector<std::string> words)
      : text_(text), grammar_(&grammar), words_(std::move(words)) {}

  Action read() {
    Action action{.what = grammar_->what};
    for (const char* kind = grammar_->rest; *kind; ++kind) read(*kind, action);
    if (next_ != words_.size()) wrong("'" + words_[next_] + "' is too much");
    return action;
  }

 private:
  [[noreturn]] void wrong(const std::string& why) const {
    refuse_action(text_, why, std::string("write ") + grammar_->usage);
  }
  const std::string& word(const char* what) {
    if (next_ == words_.size()) wrong(std::string(what) + " is missing");
    return words_[next_++];
  }
  double number(const char* what) {
    const std::string& one = word(what);
    const auto value = parse_number(one);
    if (!value || !std::isfinite(*value)) wrong("'" + one + "' is not a finite number");
    return *value;
  }
  std::int64_t whole(const char* what, double least, double most) {
    const double value = number(what);
    if (!(value >= least && value <= most) || value != std::floor(value))
      wrong("'" + words_[next_ - 1] + "' is not " + what);
    return static_cast<std::int64_t>(value);
  }

  void read(char kind, Action& action) {
    if (kind == 'i') action.particle = static_cast<int>(whole("the id of a particle", 0, 2e9));
    if (kind == 'j') action.other = static_cast<int>(whole("the id of a particle", 0, 2e9));
    if (kind == 'v') action.value = number("a number");
    if (kind == 'x')
      for (int axis = 0; axis < 3; ++axis) action.x[axis] = number("a coordinate");
    if (kind == 'm') action.name = word("the name of an integrator");
    if (kind == 's') {
      action.name = word("the name of a switch");
      const std::string& state = word("on or off");
      if (state != "on" && state != "off") wrong("'" + state + "' is neither on nor off");
      action.on = state == "on";
    }
    if (kind == 'n') {
      if (word("over") != "over") wrong("'" + words_[next_ - 1] + "' is not the word over");
      action.steps = whole("a number of steps, at least 1", 1, kMostMoveSteps);
    }
  }

  std::string_view text_;
  const Grammar* grammar_;
  std::vector<std::string> words_;
  std::size_t next_ = 1;
};

}  // namespace

bool Action::changes_settings() const {
  return what == What::kPin || what == What::kUnpin || what == What::kSwitch || what == What::kDt ||
         what == What::kIntegrator;
}

std::string to_text(const Action& action) {
  const Grammar& grammar = grammar_of(action.what);
  std::string text = grammar.word;
  for (const char* kind = grammar.rest; *kind; ++kind) {
    if (*kind == 'i') text += " " + std::to_string(action.particle);
    if (*kind == 'j') text += " " + std::to_string(action.other);
    if (*kind == 'v') text += " " + shortest(action.value);
    if (*kind == 'x')
      for (int axis = 0; axis < 3; ++axis) text += " " + shortest(action.x[axis]);
    if (*kind == 'n') text += " over " + std::to_string(action.steps);
    if (*kind == 's') text += " " + action.name + (action.on ? " on" : " off");
    if (*kind == 'm') text += " " + action.name;
  }
  return text;
}

Action parse_action(std::string_view text) {
  std::vector<std::string> words = split_words(text);
  const std::string first = words.empty() ? "" : words.front();
  const auto grammar =
      std::ranges::find_if(kGrammar, [&](const Grammar& each) { return first == each.word; });
  if (grammar == kGrammar.end()) {
    std::vector<std::string> known;
    for (const Grammar& each : kGrammar) known.emplace_back(each.word);
    refuse_action(text, "there is no such action", suggestion(first, known));
  }
  return ActionReader(text, *grammar, std::move(words)).read();
}

// Moves along a line at one velocity: v = (x - x_0) / (n h). The particle has infinite mass, so
// that every method moves it by itself, through its stages.
void apply(Simulation& simulation, const Action& action) {
  switch (action.what) {
    case What::kGrab:
      return simulation.set_held(action.particle, true);
    case What::kRelease:
      return simulation.set_held(action.particle, false);
    case What::kPin:
      return simulation.set_pinned(action.particle, true);
    case What::kUnpin:
      return simulation.set_pinned(action.particle, false);
    case What::kCut:
      return simulation.cut(action.particle, action.other);
    case What::kSwitch:
      return simulation.set_switch(action.name, action.on);
    case What::kDt:
      return simulation.set_dt(action.value);
    case What::kPosition:
      return simulation.set_position(action.particle, action.x);
    case What::kVelocity:
      return simulation.set_velocity(action.particle, action.x);
    case What::kComponent:
      return simulation.set_component(action.particle, action.value);
    case What::kReset:
      return simulation.reset();
    case What::kIntegrator:
      if (!action.method)
        throw Error(ErrorKind::kInternal,
                    {"an integrator without its method", action.name, "", ""});
      return simulation.set_integrator(*action.method);
    case What::kMove:
      break;
  }
  if (!std::ranges::binary_search(simulation.settings().held, action.particle))
    throw Error(ErrorKind::kUsage,
                {"nothing to move", "",
                 "particle " + std::to_string(action.particle) + " is not held", "grab it first"});
  const double time = static_cast<double>(action.steps) * simulation.h();
  const Vec3 way = action.x - simulation.position(action.particle);
  const Vec3 velocity = (1 / time) * way;
  if (!velocity.allFinite())
    throw Error(ErrorKind::kUsage, {"nothing to move to", "", "the place is too far away",
                                    "give a place within the scene"});
  simulation.set_velocity(action.particle, velocity);
}

void Moves::note(const Action& action, std::int64_t step) {
  if (action.what == What::kReset) return clear();
  const bool moves = action.what == What::kMove;
  if (!moves && action.what != What::kGrab && action.what != What::kRelease) return;
  std::erase_if(moves_, [&](const Move& each) { return each.particle == action.particle; });
  if (moves) moves_.push_back({action.particle, step + action.steps});
}

std::int64_t Moves::due() const {
  std::int64_t due = std::numeric_limits<std::int64_t>::max();
  for (const Move& each : moves_) due = std::min(due, each.end);
  return due;
}

void Moves::forget_ended(std::int64_t step) {
  std::erase_if(moves_, [&](const Move& each) { return each.end <= step; });
}

bool Moves::end_due(Simulation& simulation) {
  const auto over = [&](const Move& each) { return each.end <= simulation.step_count(); };
  for (const Move& each : moves_)
    if (over(each)) simulation.set_velocity(each.particle, Vec3::Zero());
  return std::erase_if(moves_, over) > 0;
}

}  // namespace sim
