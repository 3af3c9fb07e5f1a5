// `sim SCENE --error E`: a method and a step for each system, and what is said of them.
#pragma once

#include <string>
#include <vector>

#include "cli/run/run.h"
#include "core/study/accuracy/error_goal.h"
#include "core/study/verdict/parting.h"

namespace sim::cli {

// Throws Error{kUsage} for what does not go with --error.
void check_error_request(const RunRequest& request);

// Chooses for each system and makes it anew with its choice; with --until-horizon the request ends
// where the first of them is no longer kept. Empty when a signal ended it: then `caught` is that.
std::vector<study::GoalChoice> choose_for_error(RunRequest& request, LoadedScene& scene,
                                                Registry& registry, Console& console, int& caught);

// Three or four lines for people, and an object for machines.
std::string error_choice_text(const study::GoalChoice& choice, const RunRequest& request);
std::string error_choice_json(const study::GoalChoice& choice, const RunRequest& request);

// What the choice says of the run it was measured on, for the verdict; not compared where it says
// nothing of positions.
study::Parting parting_of(const study::GoalChoice& choice, const RunRequest& request);

// Throws Error{kCheck} where the error is not kept to the end of the run.
void check_error_kept(const study::GoalChoice& choice, const RunRequest& request);

}  // namespace sim::cli
