#include "core/particles/implicit/memory_first.h"

namespace sim {

void MemorySystem::eval(double t, const Stage& stage, double* y, double* dydt) {
  combine(stage, y);
  ParticleView view;
  view.t = t;
  view.memory = {y, size()};
  particles_->derive(view, dydt);
}

MemoryFirst::MemoryFirst(const Particles& particles, std::unique_ptr<StageSolver> solver,
                         const StageOptions& options)
    : behind_(particles.layout().size()),
      system_(particles),
      of_memories_(system_.stage_solver(options)),
      solver_(std::move(solver)) {}

StepStatus MemoryFirst::solve(double t, double tau, const double* r, double* y) {
  const StepStatus status = of_memories_->solve(t, tau, r + behind_, y + behind_);
  return status == StepStatus::kDone ? solver_->solve(t, tau, r, y) : status;
}

}  // namespace sim
