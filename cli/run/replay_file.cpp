#include "cli/run/replay_file.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/base/read_file.h"
#include "core/base/text.h"
#include "core/report/summary.h"

namespace sim::cli {
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

void complete(SceneRequest& request, const RecordingHeader& header, const std::string& file) {
  const auto number = [&](const std::string& word, const std::string& value) {
    const auto parsed = parse_number(value);
    if (!parsed || !(*parsed >= 0))
      refuse_recording(file, "its header says " + word + " '" + value + "'", "give a number");
    return *parsed;
  };
  for (const auto& [word, value] : header) {
    if (word == "scene") {
      if (request.scene.empty()) request.scene = value;
    } else if (word == "set") {
      const std::size_t equals = value.find('=');
      if (equals == std::string::npos || equals == 0)
        refuse_recording(file, "its header says set '" + value + "'", "write set NAME=VALUE");
      request.settings.emplace(value.substr(0, equals), value.substr(equals + 1));
    } else if (word == "off") {
      request.off.push_back(value);
    } else if (word == "without") {
      request.without.push_back(value);
    } else if (word == "seed") {
      if (request.seed == 0) request.seed = static_cast<std::uint64_t>(number(word, value));
    } else if (word == "integrator") {
      if (request.integrator.name.empty()) {
        MethodChoice choice = parse_integrator(value);
        request.integrator = request.integrator.over(choice);
      }
    } else if (word == "dt" && request.dt == 0) {
      request.dt = number(word, value);
    }
  }
}

void Replays::complete(SceneRequest& request) {
  same_ = request.settings.empty() && request.off.empty() && request.without.empty() &&
          request.integrator.name.empty() && request.integrator.given.empty() && request.dt == 0 &&
          request.seed == 0;
  cli::complete(request, recording_.header, file_);
  for (const auto& [word, value] : recording_.header)
    same_ = same_ && (word != "scene" || request.scene == value);
  if (request.scene.empty())
    refuse_recording(file_, "it names no scene", "give one: sim SCENE --replay FILE");
}

const RecordedSystem* Replays::recorded(std::size_t system) const {
  const auto found = recording_.systems.find(names_[system]);
  return found == recording_.systems.end() ? nullptr : &found->second;
}

std::int64_t Replays::steps(std::size_t system) const {
  const RecordedSystem* const found = recorded(system);
  return found ? found->end : 0;
}

void Replays::begin(const LoadedScene& scene, Registry& registry) {
  names_ = scene.spec.world ? scene.names() : std::vector<std::string>{""};
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

void Replays::perform(std::size_t system, Track& track) {
  Replay& replay = replays_[system];
  try {
    if (const auto energy = replay.perform(track.system())) track.touched(*energy);
  } catch (const Error& error) {
    ErrorText text = error.text();
    text.where = file_ + ":" + std::to_string(replay.line());
    throw Error(error.kind() == ErrorKind::kUsage ? ErrorKind::kScene : error.kind(), text);
  }
}

std::string Replays::compare(const LoadedScene& scene) const {
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

RecordingHeader recording_header(const SceneRequest& request) {
  RecordingHeader header{{"scene", request.scene}};
  for (const auto& [name, value] : request.settings) header.emplace_back("set", name + "=" + value);
  for (const std::string& name : request.off) header.emplace_back("off", name);
  for (const std::string& name : request.without) header.emplace_back("without", name);
  if (request.seed != 0) header.emplace_back("seed", std::to_string(request.seed));
  if (!request.integrator.name.empty()) {
    std::string label = request.integrator.name;
    char separator = ':';
    for (const auto& [name, value] : request.integrator.given) {
      label += separator + name + "=" + to_text(value);
      separator = ',';
    }
    header.emplace_back("integrator", label);
  }
  if (request.dt > 0) header.emplace_back("dt", shortest(request.dt));
  return header;
}

Method method_of(const Action& action, Registry& registry) {
  const MethodChoice choice = parse_integrator(action.name);
  return Method(registry, typed(choice, choice.name, registry));
}

}  // namespace sim::cli
