#include "particle_solvers.h"

#include <algorithm>

#include "block_triangular_solver.h"
#include "constrained_stage_solver.h"
#include "core/base/error.h"
#include "core/particles/constraints/constrained_impact_events.h"
#include "event_solver.h"
#include "imex_stepper.h"
#include "local_global_solver.h"
#include "newton_solver.h"

namespace sim {
namespace {

[[noreturn]] void refuse(const std::string& why, const std::string& remedy) {
  throw Error(ErrorKind::kScene, {"integrator does not fit", "", why, remedy});
}

[[noreturn]] void refuse_constraints(const std::string& why, const std::string& remedy) {
  refuse("this scene has constraints, and " + why, remedy);
}

[[noreturn]] void refuse_contact(const std::string& why) {
  refuse("this scene has colliders, and " + why,
         "use rk4, verlet, trbdf2 or dopri5, or contact as a force: sim.force.contact { collider = "
         "..., stiffness = ... }");
}

}  // namespace

std::unique_ptr<StageSolver> ParticleSolvers::stage_solver(const StageOptions& options) {
  ParticleSystem& system = *system_;
  const Contacts& contacts = system.contacts();
  ConstraintSystem* const constraints = system.constraint_system();
  const auto asked = [&system] { return system.stopped(); };
  const bool follows = system.internal_follows_particles();
  const bool local_global = options.method == StageOptions::Method::kLocalGlobal;
  if (local_global && constraints)
    refuse_constraints("projective dynamics knows springs alone", "use implicit_euler or rk4");
  system.require_accuracy();
  const bool touches = constraints && constraints->joins_contact();
  if (touches) {
    // Friction is left out of the equations of methods of low order, which keeps them smooth.
    system.constrained_events().set_smooth(contacts.accuracy() == Accuracy::kSettle &&
                                           options.order <= 2);
    if (follows) refuse_contact("a force remembers what particles do");
  } else if (!contacts.empty() && !constraints) {
    if (local_global) refuse_contact("projective dynamics knows springs alone");
    if (follows) refuse_contact("a force remembers what particles do");
    // Methods of higher order end their steps at impacts, and f includes the resting contacts.
    if (options.order > 2) {
      const bool rubs = std::ranges::any_of(contacts.all(), [](const Collider* collider) {
        return collider->material().friction > 0;
      });
      return std::make_unique<EventSolver>(system.impact_events(), rubs, newton(options, nullptr),
                                           system.OdeSystem::stage_solver(sparing(options)));
    }
  }
  if (local_global) return std::make_unique<LocalGlobalSolver>(system, options, asked);
  if (follows || constraints) {
    if (options.long_steps && !touches && !follows)
      if (auto solver = ConstrainedStageSolver::make(system, constraints->constraints(),
                                                     constraints->internal_begin(), asked))
        return solver;
    return system.OdeSystem::stage_solver(touches ? sparing(options) : options);
  }
  return newton(options, contact_of_system());
}

std::unique_ptr<ImplicitExplicitStepper> ParticleSolvers::implicit_explicit_stepper(
    const ImplicitExplicitPlan& plan) {
  ParticleSystem& system = *system_;
  if (system.internal_follows_particles()) return nullptr;
  if (system.constraint_system())
    refuse_constraints("a method that is implicit in stiff forces alone has no part for them",
                       "use verlet, rk4 or trbdf2");
  const auto stiff = [&system](const Force& force) { return system.stiff(force); };
  for (Force* const force : system.forces())
    if (force->breakable() && stiff(*force) == true)
      refuse("'" + system.name_of(*force) + "' has stiff = true, and what is stiff cannot break",
             "leave out stiff, or use trbdf2");
  return std::make_unique<ImexStepper>(system, system, stiff, contact_of_system(), plan);
}

ImplicitContact* ParticleSolvers::contact_of_system() {
  if (!system_->contacts().empty() && !contact_)
    contact_ = std::make_unique<ImplicitContact>(*system_);
  return contact_.get();
}

// A dense Jacobian takes as many evaluations of f as there are unknowns, and each is expensive if
// there are resting contacts.
StageOptions ParticleSolvers::sparing(StageOptions options) const {
  constexpr std::size_t kFewNumbers = 100;
  if (system_->size() > kFewNumbers && options.solver == StageOptions::Solver::kAuto)
    options.solver = StageOptions::Solver::kIterative;
  return options;
}

std::unique_ptr<StageSolver> ParticleSolvers::newton(const StageOptions& options,
                                                     ImplicitContact* contact) {
  const auto asked = [system = system_] { return system->stopped(); };
  auto solver = std::make_unique<NewtonSolver>(*system_, options, asked, contact);
  if (system_->internal_size() == 0) return solver;
  return std::make_unique<BlockTriangularSolver>(*system_, std::move(solver), options);
}

std::unique_ptr<ImplicitSolvers> make_particle_solvers(ParticleSystem& system) {
  return std::make_unique<ParticleSolvers>(system);
}

}  // namespace sim
