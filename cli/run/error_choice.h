// `sim SCENE --error E`: a method and a step for each system, and their report.
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "cli/run/run.h"
#include "core/study/accuracy/error_goal.h"
#include "core/study/verdict/run_deviation.h"

namespace sim::cli {

// The choice of each system; empty for one without a required error.
using GoalChoices = std::vector<std::optional<study::GoalChoice>>;

// Throws Error{kUsage} for options that exclude --error.
void check_error_request(const RunRequest& request);

// Chooses for each system of which --error, or else the scene, asks for an error, and makes it anew
// with its choice; with --until-horizon the request ends where the first of them is no longer kept.
// Empty if the callback ended it. `notes`: lines for people.
GoalChoices choose_for_error(RunRequest& request, LoadedScene& scene, Registry& registry,
                             const study::Watch& watch, std::ostream& notes);

// The same with a bar on the terminal. A signal ends it: then `caught` is that.
GoalChoices choose_for_error(RunRequest& request, LoadedScene& scene, Registry& registry,
                             Console& console, int& caught);

// Some lines for people, and an object for machines; "" if there is none.
std::string error_choice_text(const std::optional<study::GoalChoice>& choice,
                              const RunRequest& request);
std::string error_choice_json(const std::optional<study::GoalChoice>& choice,
                              const RunRequest& request);

// The deviation that the choice measured, for the verdict; not compared if it does not concern
// positions.
study::RunDeviation parting_of(const std::optional<study::GoalChoice>& choice,
                               const RunRequest& request);

// Throws Error{kCheck} if the error is not kept to the end of the run.
void check_error_kept(const std::optional<study::GoalChoice>& choice, const RunRequest& request);

}  // namespace sim::cli
