// Recordings of what was done with a scene: the scene that they name, and runs that repeat them.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/session/replay.h"
#include "core/study/run/track.h"
#include "core/study/study.h"

namespace sim::report {

// A scene as it is asked for.
struct NamedScene : SceneVariant {
  std::string scene;
  std::uint64_t seed = 0;
};

// The header of a recording of such a scene.
using RecordingHeader = std::vector<std::pair<std::string, std::string>>;
RecordingHeader recording_header(const NamedScene& asked);

// Completes what is asked for from a header. Throws Error{kScene} with the name of the file for an
// invalid one.
void complete(NamedScene& asked, const RecordingHeader& header, const std::string& file);

// The method that an action names; throws Error{kUsage}.
Method method_of(const Action& action, Registry& registry);

class Replays {
 public:
  // Throws Error{kIo} and the errors of parse_recording.
  explicit Replays(const std::string& file);

  // Completes it from the recording: scene, settings, switches, seed, integrator, step. Throws
  // Error{kScene} for an invalid header.
  void complete(NamedScene& asked);
  // The same for a scene that is made already: other words than those of the recording are no
  // error, but its bits need not be those recorded.
  void compare_with(const NamedScene& made);

  // With the methods of all actions. Throws Error{kScene} for a recording of other systems.
  void begin(const StudiedScene& scene, Registry& registry);
  std::int64_t steps(std::size_t system) const;
  std::int64_t due(std::size_t system, const Simulation& simulation) const {
    return replays_[system].due(simulation);
  }

  // Performs the recorded actions of the present state; throws Error{kScene} with the line of a bad
  // one.
  void perform(std::size_t system, study::Track& track);

  // At the end; a remark for people. Throws Error{kCheck} for other bits than those recorded.
  std::string compare(const StudiedScene& scene) const;

 private:
  const RecordedSystem* recorded(std::size_t system) const;

  std::string file_;
  Recording recording_;
  bool same_ = true;  // the request says nothing else than the recording: so the bits must be
  std::vector<std::string> names_;
  std::vector<Replay> replays_;
};

}  // namespace sim::report
