// Commands to a live scene, checked and carried out.
#include <algorithm>
#include <sstream>
#include <utility>

#include "cli/view/live.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/study/budget.h"

namespace sim::cli {
namespace {

constexpr double kFurthest = 1e9;  // m, the reach of a user

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

}  // namespace

std::string Live::take(std::uint64_t from, const std::string& line) {
  fresh_ = true;
  travel([] { return true; });
  try {
    obey(from, line);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

// The first word, which leaves the line.
std::string Live::word_of(std::string& line) {
  const std::size_t end = std::min(line.find(' '), line.size());
  std::string word = line.substr(0, end);
  line.erase(0, std::min(end + 1, line.size()));
  return word;
}

void Live::obey(std::uint64_t from, const std::string& line) {
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
    pull(system, arguments);
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
}

void Live::pull(std::size_t system, std::string arguments) {
  const int particle = static_cast<int>(number_in(word_of(arguments), 0, 2e9));
  Vec3 to;
  for (std::size_t axis = 0; axis < 3; ++axis)
    to[axis] = number_in(word_of(arguments), -kFurthest, kFurthest);
  bool any = false;
  for (Hand& hand : hands_)
    if ((all_ || hand.system == system) && hand.particle == particle) {
      hand.to = to;
      hand.pulled = any = true;
    }
  if (any) return;
  refuse_word("nothing to pull", "particle " + std::to_string(particle) + " is not held");
}

void Live::ask_for_error(const std::string& argument) {
  if (all_) refuse_word("no error here", "each panel has a method of its own");
  const bool off = argument == "off";
  if (!off) study::parse_budget("error", argument);
  goal_ = {.number = goal_.number + 1, .busy = !off, .asked = off ? "" : argument};
}

// Several actions at once are one for an undo.
void Live::choose(const FoundChoice& found) {
  Goal goal = std::move(goal_);
  std::istringstream commands(found.commands);
  goal.words = found.words;
  for (std::string line; std::getline(commands, line);)
    if (const std::string refused = take(0, line); !refused.empty()) goal.words = refused;
  goal.busy = false;
  goal_ = std::move(goal);
  fresh_ = true;
}

// Commands that change no state but the time that is shown; false for another word.
bool Live::control(const std::string& word, const std::string& argument, std::uint64_t from) {
  constexpr double kMostBack = 1e6, kFastest = 100;
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
    const auto count = static_cast<std::int64_t>(number_in(argument, 1, 1000));
    travel_ = Travel{.to = player_.step() + count};
  } else if (word == "back") {
    playing_ = false;
    const auto count = static_cast<std::int64_t>(number_in(argument, 1, kMostBack));
    travel_ = Travel{.to = player_.step() - count, .known = true};
  } else if (word == "goto") {
    playing_ = false;
    travel_ = Travel{.to = player_.step_at(number_in(argument, 0, 1e9)), .known = true};
  } else if (word == "undo") {
    hands_.clear();
    bool any = false;
    for (std::size_t i = 0; i < player_.count(); ++i)
      any = any || player_.timeline(i).actions() > before_[i];
    if (!any || !player_.undo()) refuse_word("nothing to undo", "no hand has done anything");
    goal_ = {.number = goal_.number};
    measured_.begin_anew();
    begin_anew();
    shares_stale_ = true;
  } else if (word == "reset") {
    hands_.clear();
    player_.reset();
    before_.assign(player_.count(), 0);
    measured_.afford(few());
    measured_.begin_anew();
    accounts_.clear();
    for (std::size_t i = 0; i < player_.count(); ++i)
      accounts_.emplace_back(player_, i, scene_.spec.systems[i], registry_);
    begin_anew();
  } else if (word == "colour") {
    measured_.ask(from, argument);
  } else if (word == "error") {
    ask_for_error(argument);
  } else if (word == "bye") {
    measured_.leave(from);
    let_go(from);
  } else {
    return false;
  }
  return true;
}

}  // namespace sim::cli
