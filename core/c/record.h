// A recording of what is done with a scene by calls.
#pragma once

#include <cstddef>
#include <string>

#include "core/c/sim.h"
#include "core/report/recording_file.h"
#include "core/session/recording.h"

namespace sim::c {

class SceneRecord {
 public:
  // The scene, at its start, outlives it. The file takes its name at once and grows with each
  // action. Throws Error{kIo}.
  SceneRecord(const sim_scene& scene, const std::string& file);
  ~SceneRecord();  // as finish(), whatever becomes of it
  SceneRecord(const SceneRecord&) = delete;
  SceneRecord& operator=(const SceneRecord&) = delete;

  void action(std::size_t system, const Action& action);  // that was done
  void reset();                                           // that is about to be done
  // With the hashes of now. Throws Error{kIo} where lines are missing.
  void finish();

 private:
  std::string name_of(std::size_t system) const;

  const sim_scene& scene_;
  std::string failure_;
  report::RecordingFile file_;
  RecordingWriter writer_;
  bool finished_ = false;
};

// Throws Error{kUsage} for what a recording cannot tell.
void refuse_in_record(const sim_scene& scene, const char* what);

}  // namespace sim::c
