// The solver that suits a system of particles and a method.
#pragma once

#include <memory>

#include "core/particles/implicit_solvers.h"
#include "core/particles/particle_system.h"
#include "implicit_contact.h"

namespace sim {

class ParticleSolvers final : public ImplicitSolvers {
 public:
  explicit ParticleSolvers(ParticleSystem& system) : system_(&system) {}

  std::unique_ptr<StageSolver> stage_solver(const StageOptions& options) override;
  std::unique_ptr<ImplicitExplicitStepper> implicit_explicit_stepper(
      const ImplicitExplicitPlan& plan) override;
  StageContact* contact() noexcept override { return contact_.get(); }

 private:
  ImplicitContact* contact_of_system();  // null without colliders
  std::unique_ptr<StageSolver> newton(const StageOptions& options, ImplicitContact* contact);
  StageOptions sparing(StageOptions options) const;

  ParticleSystem* system_;
  std::unique_ptr<ImplicitContact> contact_;
};

// Serves a system that has no registry.
std::unique_ptr<ImplicitSolvers> make_particle_solvers(ParticleSystem& system);

}  // namespace sim
