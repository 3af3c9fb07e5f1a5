// The stable step of each integrator on a system, predicted and measured, and the energy error near
// it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/study/limits/spectrum.h"
#include "core/study/problem.h"

namespace sim::study {

// A run of the system from its start with the step `fraction` of the limit.
struct EnergyAtStep {
  double fraction = 0, dt = 0;  // dt in s
  double error = 0;             // largest |E + W - E0| over the energy in play; infinity: diverged
};

struct MethodStability {
  Candidate method;
  // The stable step, s; 0 = no step is stable, infinity = none is unstable. Not predicted if the
  // method does not know its own stability; not measured if it chooses its own steps.
  std::optional<double> predicted, measured;
  std::optional<double> radius;  // growth of the fastest mode in one step of the dt asked about
  std::vector<EnergyAtStep> energy;
  bool late = false;  // not all of these were run: the study took far longer than it had said
};

struct Stability {
  std::string system, integrator;
  double t = 0, dt = 0;  // s; dt and integrator: as a run would have them
  Spectrum spectrum;
  double energy_time =
      0;  // s, the length of the runs behind EnergyAtStep; none where too many steps
  std::vector<MethodStability> methods;
  bool complete = true;  // false when it was told to end
};

struct StabilityOptions {
  double at = 0;                               // s: look at the state that the run has reached then
  std::vector<MethodChoice> integrators = {};  // empty = all that fit
  // Called, once the vibrations are known, with the expected duration of the rest, s, by the
  // predicted limits.
  std::function<void(double seconds)> announce = {};
};

// Throws Error{kUsage} if the system diverges before `at`.
Stability stability(const Problem& problem, const StabilityOptions& options, const Watch& watch);

// True if it takes adaptive steps, or chooses a method that does: then no requested step limits it.
inline bool has_own_steps(const Candidate& method) {
  return method.info.adaptive || method.chooses;
}

// The stable step of a method: the measured one, or else the predicted one; empty if neither is
// known.
std::optional<double> step_limit(const MethodStability& method);

}  // namespace sim::study
