// The contents of the branches of a session, and the results that its runs leave behind.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "cli/run/scene.h"
#include "core/session/difference.h"
#include "core/session/timeline.h"
#include "core/study/verdict/verdict.h"

namespace sim::cli {

// A scene as it was read, which branches share.
struct SceneOrigin {
  SceneRequest request;
  LoadedScene scene;
  std::vector<Settings> loaded;  // of its systems as loaded; differences are choices
  std::string doubt = {};        // of the checkpoint it was resumed from, see Account

  std::size_t first_choice() const;  // its first system of particles, or its first one
};

// Throws the errors of load().
std::shared_ptr<SceneOrigin> read_origin(const SceneRequest& request,
                                         const Environment& environment, Registry& registry);

struct SceneBranch {
  std::shared_ptr<SceneOrigin> origin;
  std::vector<Timeline> timelines;
  std::vector<std::int64_t> steps;
  double t = 0;  // s, of the first system
};

// The first difference between two branches.
struct FirstDifference {
  std::string system;
  std::int64_t step = 0, common = 0;
  double ta = 0, tb = 0;  // s
  Difference difference;
};

// A verdict, and the steps between which it holds.
struct Judged {
  study::Verdict verdict;
  double from = 0, to = 0;      // s
  std::optional<double> cut{};  // s, the size of a last step that was shorter
  std::string anew{};           // the method, if it keeps earlier steps and began anew for that one
};

// Observed quantities of runs, taken at each step of the present system whose number is a multiple
// of `every`.
struct Look {
  std::int64_t every;
  std::function<void()> take;
};

}  // namespace sim::cli
