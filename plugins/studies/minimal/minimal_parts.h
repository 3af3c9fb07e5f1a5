// The parts of a scene that can be left out or made smaller, each as a change of the command line.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/study/study.h"

namespace sim::studies {

struct Part {
  std::string what, option;                  // "force drag"; "--without drag"
  bool again = false;                        // it may be made smaller more than once
  std::function<bool(SceneVariant&)> apply;  // false when there is nothing more to change
};

// The parts of the scene as requested, which outlives them.
std::vector<Part> parts_of(const StudyTask& task, const StudiedScene& scene);

// The command of a run, with integrator, step and time.
std::string run_command(const StudyTask& task, const SceneVariant& variant);

}  // namespace sim::studies
