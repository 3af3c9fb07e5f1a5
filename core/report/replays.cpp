#include "core/report/replays.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/read_file.h"
#include "core/report/summary.h"
#include "core/study/method_text.h"

namespace sim::report {
namespace {

constexpr double kMostBytes = 256e6;

[[noreturn]] void refuse_recording(const std::string& file, const std::string& why,
                                   const std::string& remedy) {
  throw Error(ErrorKind::kScene, {"cannot replay", file, why, remedy});
}

}  // namespace

Replays::Replays(const std::string& file) : file_(file) {
  recording_ =
      parse_recording(read_input_file(file, kMostBytes, "give a file that --record wrote"), file);
}

void complete(NamedScene& asked, const RecordingHeader& header, const std::string& file) {
  const auto number = [&](const std::string& word, const std::string& value) {
    const auto parsed = parse_number(value);
    if (!parsed || !(*parsed >= 0))
      refuse_recording(file, "its header says " + word + " '" + value + "'", "give a number");
    return *parsed;
  };
  for (const auto& [word, value] : header) {
    if (word == "scene") {
      if (asked.scene.empty()) asked.scene = value;
    } else if (word == "set") {
      const std::size_t equals = value.find('=');
      if (equals == std::string::npos || equals == 0)
        refuse_recording(file, "its header says set '" + value + "'", "write set NAME=VALUE");
      asked.settings.emplace(value.substr(0, equals), value.substr(equals + 1));
    } else if (word == "off") {
      asked.off.push_back(value);
    } else if (word == "without") {
      asked.without.push_back(value);
    } else if (word == "seed") {
      if (asked.seed == 0) asked.seed = static_cast<std::uint64_t>(number(word, value));
    } else if (word == "integrator") {
      if (asked.integrator.name.empty()) {
        MethodChoice choice = study::parse_integrator(value);
        asked.integrator = asked.integrator.over(choice);
      }
    } else if (word == "dt" && asked.dt == 0) {
      asked.dt = number(word, value);
    }
  }
}

void Replays::complete(NamedScene& asked) {
  same_ = asked.settings.empty() && asked.off.empty() && asked.without.empty() &&
          asked.integrator.name.empty() && asked.integrator.given.empty() && asked.dt == 0 &&
          asked.seed == 0;
  report::complete(asked, recording_.header, file_);
  for (const auto& [word, value] : recording_.header)
    same_ = same_ && (word != "scene" || asked.scene == value);
  if (asked.scene.empty())
    refuse_recording(file_, "it names no scene", "give one: sim SCENE --replay FILE");
}

void Replays::compare_with(const NamedScene& made) {
  NamedScene recorded;
  report::complete(recorded, recording_.header, file_);
  same_ = recorded.scene == made.scene && recorded.settings == made.settings &&
          recorded.off == made.off && recorded.without == made.without &&
          recorded.seed == made.seed && recorded.integrator == made.integrator &&
          recorded.dt == made.dt;
}

const RecordedSystem* Replays::recorded(std::size_t system) const {
  const auto found = recording_.systems.find(names_[system]);
  return found == recording_.systems.end() ? nullptr : &found->second;
}

std::int64_t Replays::steps(std::size_t system) const {
  const RecordedSystem* const found = recorded(system);
  return found ? found->end : 0;
}

void Replays::begin(const StudiedScene& scene, Registry& registry) {
  names_.clear();
  replays_.clear();
  for (const Simulation& system : scene.systems)
    names_.push_back(scene.spec.world ? system.name() : "");
  for (const auto& [name, system] : recording_.systems)
    if (!std::ranges::count(names_, name))
      refuse_recording(file_, "the scene has no system '" + name + "'",
                       "give the scene it was made with");
  for (std::size_t i = 0; i < names_.size(); ++i) {
    std::vector<RecordedAction> actions;
    if (const RecordedSystem* const found = recorded(i)) actions = found->actions;
    for (RecordedAction& each : actions)
      if (each.action.what == Action::What::kIntegrator) try {
          each.action.method = method_of(each.action, registry);
        } catch (const Error& error) {
          ErrorText text = error.text();
          text.where = file_ + ":" + std::to_string(each.line);
          throw Error(ErrorKind::kScene, text);
        }
    replays_.emplace_back(std::move(actions));
  }
}

void Replays::perform(std::size_t system, study::Track& track) {
  Replay& replay = replays_[system];
  try {
    if (const auto energy = replay.perform(track.system())) track.touched(*energy);
  } catch (const Error& error) {
    ErrorText text = error.text();
    text.where = file_ + ":" + std::to_string(replay.line());
    throw Error(error.kind() == ErrorKind::kUsage ? ErrorKind::kScene : error.kind(), text);
  }
}

std::string Replays::compare(const StudiedScene& scene) const {
  if (!same_) return "not the settings of the recording: other bits are right";
  if (!recording_.whole)
    return file_ + " has no end, it was cut off: replayed up to line " +
           std::to_string(recording_.lines);
  std::string other;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    const Simulation& system = scene.systems[i];
    const RecordedSystem* const found = recorded(i);
    if (found && *found->hash != system.hash())
      other += (other.empty() ? "" : ", ") + system.name() + " has " + hash_text(system);
  }
  if (other.empty()) return file_ + " replayed: the same bits";
  throw Error(ErrorKind::kCheck, {"other bits than those recorded", file_, other,
                                  "was the scene or the recording changed?"});
}

RecordingHeader recording_header(const NamedScene& asked) {
  RecordingHeader header{{"scene", asked.scene}};
  for (const auto& [name, value] : asked.settings) header.emplace_back("set", name + "=" + value);
  for (const std::string& name : asked.off) header.emplace_back("off", name);
  for (const std::string& name : asked.without) header.emplace_back("without", name);
  if (asked.seed != 0) header.emplace_back("seed", std::to_string(asked.seed));
  if (!asked.integrator.name.empty()) {
    std::string label = asked.integrator.name;
    char separator = ':';
    for (const auto& [name, value] : asked.integrator.given) {
      label += separator + name + "=" + to_text(value);
      separator = ',';
    }
    header.emplace_back("integrator", label);
  }
  if (asked.dt > 0) header.emplace_back("dt", shortest(asked.dt));
  return header;
}

Method method_of(const Action& action, Registry& registry) {
  const MethodChoice choice = study::parse_integrator(action.name);
  return Method(registry, study::typed(choice, choice.name, registry));
}

}  // namespace sim::report
