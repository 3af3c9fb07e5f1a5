// Solvers for the equations of implicit methods on particles. A plugin of the kind `solver` makes
// them; the system asks for them when a method first needs some.
#pragma once

#include <functional>
#include <memory>

#include "core/ode/ode_system.h"

namespace sim {

class ParticleSystem;
struct ParticleView;

// Contact inside the equations of a step, of particles with colliders and without constraints.
class StageContact {
 public:
  virtual ~StageContact() = default;

  // They frame the stages of a step, see OdeSystem::begin_step(). bounces: an impact bounces at the
  // end, or else somebody else cuts the step there.
  virtual const double* begin(double t, double h, const double* x, bool again) = 0;
  virtual StepEnd end(double* x_next, bool bounces) = 0;
  virtual bool had_impact() const noexcept = 0;

  // Adds the contact forces at the start of the step to the accelerations `a`.
  virtual void accelerate(const ParticleView& view, double* const a[3]) const = 0;
};

// Made for one system, which outlives it.
class ImplicitSolvers {
 public:
  virtual ~ImplicitSolvers() = default;

  // They answer for OdeSystem::stage_solver() and implicit_explicit_stepper().
  virtual std::unique_ptr<StageSolver> stage_solver(const StageOptions& options) = 0;
  virtual std::unique_ptr<ImplicitExplicitStepper> implicit_explicit_stepper(
      const ImplicitExplicitPlan& plan) = 0;

  virtual StageContact* contact() noexcept = 0;  // null: no equation so far has any
};

using MakeImplicitSolvers = std::function<std::unique_ptr<ImplicitSolvers>(ParticleSystem&)>;

}  // namespace sim
