// The error that a scene, or its method, requires of a run.
#pragma once

#include <optional>

#include "core/scene/scene_spec.h"
#include "core/study/budget.h"

namespace sim::study {

// The error that a run has to keep.
struct RequiredError {
  Budget budget = {};
  bool asked = true;  // false: nothing but a method that chooses among others was asked for
};

// True for a method that chooses among others as it goes.
bool chooses_among_others(const MethodChoice& method, Registry& registry);

// The error that a system requires itself, or else 0.1 % of the size where its method chooses among
// others, as `auto` does. None beside a tolerance, and a step that is given leaves the choice to
// the method. `named`, `dt`: an integrator and a step that replace those of the system, or nothing.
std::optional<RequiredError> required_error(const SystemSpec& spec, const MethodChoice& named,
                                            double dt, Registry& registry);

}  // namespace sim::study
