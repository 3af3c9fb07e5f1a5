// The problem of a study: one system of a scene, to be run repeatedly with other methods and steps.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/simulation.h"
#include "core/study/quantity.h"

namespace sim {
class ParticleSystem;
}

namespace sim::study {

struct Problem {
  const SystemSpec* spec = nullptr;
  Registry* registry = nullptr;
  RunOptions options{};  // given by the user; studies choose methods and steps themselves

  // The compared quantity; nothing: the free coordinates, or all numbers of a flat state.
  std::optional<Quantity> of{};
  bool by_figure() const { return of && of->is_figure(); }  // one number for the whole run

  MethodChoice integrator() const;  // of the run, by the options or else by the scene
  Problem with(const MethodChoice& integrator) const;  // the same with another one

  Simulation simulation(double dt = 0) const;  // 0: the step of the run

  // The integrator alone, not yet prepared.
  std::unique_ptr<Integrator> make_integrator() const;
};

// A progress callback: what is being done, and the share that is done (0 .. 1); it answers false to
// end the study, which then returns its results so far.
using Watch = std::function<bool(std::string_view what, double done)>;

struct Candidate : MethodChoice {
  std::string label;  // NAME or NAME:PARAM=VALUE,... as --integrator takes it
  IntegratorInfo info;
  bool has_tolerance = false;  // has a parameter `tol`
  bool chooses = false;        // among other methods, as `auto` does
  double least_tolerance = 0;  // that `tol` may be
};

// The choices; without any, the integrators that fit the problem, sorted by name, that of the run
// with its values. Throws Error{kUsage} for an unknown name, or if a choice does not fit.
std::vector<Candidate> fitting_methods(const Problem& problem,
                                       const std::vector<MethodChoice>& choices);

// The evaluations of f so far: as the integrator counts them, or else a fixed number a step.
std::int64_t evaluations_of(const Simulation& system);

// The system of particles that a second-order simulation steps; null in a first-order one.
const ParticleSystem* particles_of(Simulation& system);
// True if something besides the method changes the state at the ends of steps: contact with
// colliders, or a StepCorrection.
bool acts_between_steps(Simulation& system);

// Single steps from any state, beside the run: nothing is stored from one step to the next.
class StepMap {
 public:
  StepMap(OdeSystem& system, std::unique_ptr<Integrator> integrator);

  // x_next := one step of size h from x at t, both system.size() doubles; false if it fails.
  bool step(double t, double h, const double* x, double* x_next);

  const Integrator& integrator() const { return *integrator_; }
  void set_step_size(double h) { integrator_->set_step_size(h); }  // of the run, for such methods

 private:
  OdeSystem* system_;
  std::unique_ptr<Integrator> integrator_;
};

}  // namespace sim::study
