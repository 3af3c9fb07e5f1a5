// `sim minimal SCENE`: which parts of a scene does a result need, and what does each cost?
#pragma once

#include <optional>
#include <string>

#include "cli/run/run.h"
#include "cli/run/scene.h"
#include "cli/terminal/console.h"
#include "cli/verbs/tradeoff.h"

namespace sim::cli {

struct MinimalRequest {
  SceneRequest scene;
  Budget budget{0.01, false};  // change allowed: of the size, or of the range of `of`
  std::string of;              // as study::Quantity; empty: positions
  std::optional<double> time;  // s; nothing = the scene's duration
  bool json = false;
  ShowProgress progress = ShowProgress::kAuto;
};

// Leaves out each force, spring family, collider and numeric parameter in turn, takes half the
// particles a side where the scene has a parameter `n`, single precision, twice the step and the
// next simpler method; then all of that together which stays within the budget. A table, and the
// smallest scene as a command.
int minimal(const MinimalRequest& request, const Environment& environment, Registry& registry,
            Console& console);

}  // namespace sim::cli
