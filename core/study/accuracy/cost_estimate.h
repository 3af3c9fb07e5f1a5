// Estimates of the duration of a study, from a few runs of its scene before it begins.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/study/accuracy/sweep.h"

namespace sim::study {

// The error of a method of order p with steps h is taken to be (h rate)^p of the scene's size,
// whatever the method: so one method predicts the others. Good to a factor of 3 or so.
struct CostEstimate {
  double time = 0;                         // s, of each run
  double seconds = 0;                      // an evaluation takes
  double rate = 0;                         // 1/s
  std::map<std::string, double> implicit;  // s, a step of that method takes, by its label

  // The cost of runs with so many steps each, or of runs with tolerances that decrease by factors
  // of ten from the first to the last: until one is as accurate as can be measured or takes longer
  // than the limit, with all repeats.
  double steps(const Candidate& method, std::span<const std::int64_t> counts,
               const SweepLimits& limits, int repeats) const;
  double tolerances(const Candidate& method, double first, double last, const SweepLimits& limits,
                    int repeats) const;

  // The cost of a reference of so many points, and of the neighbours that a figure needs.
  double reference(int points, bool by_figure) const;

 private:
  double step(const Candidate& method) const;  // s
  double steps_to(const Candidate& method, double error) const;
};

// The time of a step, s, from a few steps at the start; empty if the first fails.
std::optional<double> seconds_a_step(const Problem& problem, const Candidate& method);

// Two runs of a method of fixed steps, with the scene's own step and half of it, or as long as
// affordable, and some steps of each implicit method: some 0.1 s.
CostEstimate cost_estimate(const Problem& problem, std::span<const Candidate> methods, double time);

}  // namespace sim::study
