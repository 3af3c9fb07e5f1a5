#include "core/study/accuracy/goal_trials.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/study/accuracy/sweep.h"
#include "core/study/limits/step_limit.h"
#include "core/study/verdict/pulses.h"

namespace sim::study {
namespace {

// One method of each kind and order on the front of work-precision studies: others are at best as
// good as one of these.
constexpr const char* kWorthTrying[] = {
    "verlet", "pefrl",  "rk4",      "tsit5",  "dop853", "implicit_midpoint",
    "imex",   "trbdf2", "esdirk43", "rodas4", "bdf"};
constexpr const char* kCheapest = "euler";  // of first-order systems at large errors

}  // namespace

GoalTrials::GoalTrials(const Problem& problem, const ErrorGoal& goal)
    : problem_(problem), goal_(goal) {
  Simulation system = problem.simulation();
  step_ = goal.dt > 0 ? goal.dt : system.h();
  pulse_ = shortest_pulse(system, goal.time);
  corrected_ = acts_between_steps(system);
}

std::int64_t GoalTrials::states_in(const Candidate& method, double time) const {
  constexpr std::int64_t kImplicitStates = 40, kStates = 120;
  const bool dense = has_dense_output(method.info, corrected_);
  if (method.info.implicit && !dense && goal_.dt == 0) return kImplicitStates;
  const auto all = static_cast<std::int64_t>(std::ceil(time / step_ - 1e-9));
  return (all + kStates - 1) / kStates * kStates;
}

std::vector<Candidate> GoalTrials::methods(Simulation& system) const {
  std::vector<MethodChoice> wanted = goal_.integrators;
  std::erase_if(wanted, [&](const MethodChoice& each) {
    return chooses_among_others(each, *problem_.registry);
  });
  std::vector<Candidate> methods = methods_to_sweep(problem_, system, wanted);
  const std::string own = problem_.registry->get<Integrator>(problem_.integrator().name).name;
  if (wanted.empty())
    std::erase_if(methods, [&](const Candidate& each) {
      const bool tried = std::ranges::find(kWorthTrying, each.name) != std::end(kWorthTrying) ||
                         (problem_.spec->first_order && each.name == kCheapest);
      return each.chooses || (!tried && each.name != own);
    });
  if (methods.empty())
    throw Error(ErrorKind::kUsage, {"no method for --error", "'" + problem_.spec->name + "'",
                                    "no integrator fits the scene", "see sim list integrators"});
  return methods;
}

std::vector<MethodTrials> GoalTrials::of(double window) const {
  constexpr double kInside = 0.9;  // of the largest stable step
  constexpr double kFewest = 20;
  Simulation system = problem_.simulation();
  const Spectrum modes = spectrum(system);
  std::vector<MethodTrials> trials;
  for (const Candidate& method : methods(system)) {
    if (Refinement(method).by_tolerance()) {
      trials.emplace_back(problem_, method, window, 1 / kFirstGoalTolerance,
                          states_in(method, window), corrected_, false);
      continue;
    }
    if (goal_.dt > 0) {
      const double steps = std::ceil(window / goal_.dt - 1e-9);
      trials.emplace_back(problem_, method, window, steps, 0, corrected_, true);
      continue;
    }
    const auto limit = predicted_step(*problem_.with(method).make_integrator(), modes);
    double steps = kFewest;
    if (limit && std::isfinite(*limit) && *limit > 0)
      steps = std::max(steps, std::ceil(window / (kInside * *limit)));
    steps = std::max(steps, std::ceil(kInPulse * window / pulse_));
    trials.emplace_back(problem_, method, window, steps, 0, corrected_, false);
  }
  return trials;
}

}  // namespace sim::study
