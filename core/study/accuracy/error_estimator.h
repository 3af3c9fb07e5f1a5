// Errors of particles while a run goes on, from the same run with half the step, or a tenth of the
// tolerance, beside it.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/scene/simulation.h"
#include "core/session/action.h"

namespace sim::study {

// The method at its most accurate: in double precision, with tolerances `kSharper` times smaller.
inline constexpr double kSharper = 10;
MethodChoice sharper(const Method& own);

// The method with tolerances `kSharper` times larger; empty if it has none, or may not.
std::optional<MethodChoice> looser(const Method& own);

// The same run with a sharper method and so many steps for each of its own, at X = x and time t.
Simulation finer_run(const SystemSpec& spec, Registry& registry, const Settings& own,
                     double steps_per_step, double t, std::span<const double> x);

// The same run with another method and step.
Simulation run_with_method(const SystemSpec& spec, Registry& registry, const Settings& own,
                           const MethodChoice& method, double dt, double t,
                           std::span<const double> x);

class ErrorEstimator {
 public:
  // Begins at the present state of the run. Spec and registry outlive it.
  ErrorEstimator(const SystemSpec& spec, const Simulation& run, Registry& registry);

  // These apply the user's actions to the refined run as well: before the run, at its present time;
  // and after it, when grabs, pins and switches are the same here. Another step or method, or a
  // jump in time, needs a new estimator.
  void advance(const Simulation& run);
  void follow(const Simulation& run);
  void act(const Action& action);  // an action that moves or pushes a particle at once

  // The error of each particle, in m, or the single one of a flat state, at the present time of the
  // run: its distance from the refined run, times the factor for the order of the method. Not
  // finite if the refined run has failed.
  std::vector<double> errors(const Simulation& run);

 private:
  Simulation fine_;
  double factor_ = 1;  // from the distance to the error
  bool ended_ = false;
};

}  // namespace sim::study
