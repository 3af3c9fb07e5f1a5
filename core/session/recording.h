// The actions of users on a scene, as text that people can read, edit and replay. A header names
// the scene; then each line gives the number of steps of its system, and the action after them:
//   scene scenes/cloth.lua
//   set n=32
//   +120 grab 27
//   +0 move 27 0.1 -0.4 0.3 over 4
//   +31 release 27
//   +86 end 9c0d5d1e0e2a7f13
// In a world the name of the system comes before the action: "+120 left: grab 3".
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/session/action.h"

namespace sim {

struct RecordedAction {
  std::int64_t step = 0;  // done between this step and the next one
  Action action;
  int line = 0;  // of the file
};

// The actions of one system, forwards only: history discarded by a reset or a step back is left
// out.
struct RecordedSystem {
  std::vector<RecordedAction> actions;  // by step; a reset is at step 0 only
  std::int64_t end = 0;                 // its last step
  std::optional<std::uint64_t> hash;    // of the state there; none: the recording was cut off
};

struct Recording {
  // scene, integrator, dt, seed, tol.. once each; set, off and without any number of times.
  std::vector<std::pair<std::string, std::string>> header;
  std::map<std::string, RecordedSystem> systems;  // by name; of a single scene: ""
  int lines = 0;
  bool whole = false;  // it has its end
};

// Parses a recording. A last line without its end is left out: it may have been truncated. Throws
// Error{kScene} with FILE:LINE for text that is no recording.
Recording parse_recording(std::string_view text, const std::string& file);

// Writes a recording. Each line is passed on at once, so that a program that dies leaves a valid
// recording.
class RecordingWriter {
 public:
  using Sink = std::function<void(std::string_view lines)>;

  // `world`: lines name their system.
  RecordingWriter(Sink sink, const std::vector<std::pair<std::string, std::string>>& header,
                  bool world);

  // `step`: the present step of the system.
  void action(const std::string& system, std::int64_t step, const Action& action);
  void reset(const std::string& system, std::int64_t step);
  void back(const std::string& system, std::int64_t from, std::int64_t to);
  // Undoes so many actions, which leads from one step to another.
  void undo(const std::string& system, std::size_t actions, std::int64_t from, std::int64_t to);
  void end(const std::string& system, std::int64_t step, std::uint64_t hash);

 private:
  void line(const std::string& system, std::int64_t step, const std::string& words);

  Sink sink_;
  bool world_;
  std::map<std::string, std::int64_t> at_;  // the step of the last line of each system
};

}  // namespace sim
