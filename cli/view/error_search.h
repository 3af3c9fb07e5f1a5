// A search for methods and steps that keep an error, beside a scene that is viewed.
#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <thread>

#include "cli/run/environment.h"
#include "cli/run/scene.h"
#include "core/study/problem.h"

namespace sim::cli {

struct FoundChoice {
  std::string commands;  // to the live scene, a line each; none: nothing was found
  std::string words;     // what was chosen, measured and paid, or why nothing was
};

// By trials of the scene as its file makes it, as --error does. Empty if the callback ended it;
// throws nothing.
FoundChoice choose_for_view(const SceneRequest& scene, const std::string& error,
                            const Environment& environment, Registry& registry,
                            const study::Watch& watch);

// The same on a thread of its own, which shares nothing with the scene that is viewed.
class ErrorSearch {
 public:
  // The environment outlives it.
  ErrorSearch(SceneRequest scene, std::string error, const Environment& environment);
  ~ErrorSearch();  // ends it
  ErrorSearch(const ErrorSearch&) = delete;
  ErrorSearch& operator=(const ErrorSearch&) = delete;

  std::optional<FoundChoice> found();  // once it has ended

 private:
  std::atomic<bool> stop_{false}, over_{false};
  FoundChoice choice_;
  std::thread thread_;  // last: it writes the others
};

}  // namespace sim::cli
