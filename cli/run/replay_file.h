// --replay FILE: repeats a run in which a user acted.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "cli/run/judged.h"
#include "cli/run/scene.h"
#include "core/session/replay.h"

namespace sim::cli {

class Replays {
 public:
  // Throws Error{kIo} and the errors of parse_recording.
  explicit Replays(const std::string& file);

  // Completes the request from the recording: scene, settings, switches, seed, integrator, step.
  // Throws Error{kScene} for an invalid header.
  void complete(SceneRequest& request);

  // With the methods of all actions. Throws Error{kScene} for a recording of other systems.
  void begin(const LoadedScene& scene, Registry& registry);
  std::int64_t steps(std::size_t system) const;
  std::int64_t due(const Simulation& simulation) const { return replays_.front().due(simulation); }

  // Performs the recorded actions of the present state; throws Error{kScene} with the line of a bad
  // one.
  void perform(std::size_t system, Track& track);

  // At the end; a remark for people. Throws Error{kCheck} for other bits than those recorded.
  std::string compare(const LoadedScene& scene) const;

 private:
  const RecordedSystem* recorded(std::size_t system) const;

  std::string file_;
  Recording recording_;
  bool same_ = true;  // the request says nothing else than the recording: so the bits must be
  std::vector<std::string> names_;
  std::vector<Replay> replays_;
};

// The header of a recording of such a scene.
using RecordingHeader = std::vector<std::pair<std::string, std::string>>;
RecordingHeader recording_header(const SceneRequest& request);

// Completes the request from a header. Throws Error{kScene} with the name of the file for an
// invalid one.
void complete(SceneRequest& request, const RecordingHeader& header, const std::string& file);

// The method that an action names; throws Error{kUsage}.
Method method_of(const Action& action, Registry& registry);

}  // namespace sim::cli
