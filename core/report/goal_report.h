// The choice of a method and a step that keep an error, for machines.
#pragma once

#include <optional>
#include <string>

#include "core/study/accuracy/error_goal.h"
#include "core/study/run/track.h"
#include "core/study/verdict/run_deviation.h"

namespace sim::report {

// {"allowed","size","of","integrator","dt","tol","error","largest","kept","horizon","chaotic",
//  "cost","over_cheapest","cost_of_ten_times","trials","check","mended","window",
//  "command","candidates":[{"integrator","cost","order","runs"}]}; `of`: the quantity, or "" for
//  positions.
std::string goal_json(const study::GoalChoice& choice, const std::string& of,
                      const std::string& command);

// The cost of the choice over that of the cheapest; not a number if nothing keeps the error.
double over_cheapest(const study::GoalChoice& choice);

// The options that repeat the run without a search, to follow the scene: " -i verlet -d 0.00625 -T
// 2".
std::string goal_options(const study::GoalChoice& choice, const std::optional<double>& time);

// The deviation that the choice measured, for the verdict on its run; not compared if the error is
// not kept or does not concern positions.
study::RunDeviation goal_deviation(const study::GoalChoice& choice, const std::string& of);

// The error of the choice is known until the pulse that its run has missed, if it has.
void take_missed_pulse(const study::Track& track, study::GoalChoice& choice);

}  // namespace sim::report
