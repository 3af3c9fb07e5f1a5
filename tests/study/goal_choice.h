// The choice for an error, with nobody who watches.
#pragma once

#include "core/study/accuracy/error_goal.h"
#include "tests/support/scenes.h"

namespace sim_test {

inline sim::study::Watch no_watch() {
  return [](std::string_view, double) { return true; };
}

inline sim::study::GoalChoice choice_of(const sim::SystemSpec& spec,
                                        const sim::study::ErrorGoal& goal) {
  sim::Registry registry = make_registry();
  return sim::study::choose_for_error({&spec, &registry}, goal, no_watch());
}

}  // namespace sim_test
