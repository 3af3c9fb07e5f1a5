#include "block_triangular_solver.h"

namespace sim {
namespace {

// A dense matrix of many weakly coupled unknowns would take all the time.
StageOptions for_many(StageOptions options, std::size_t numbers) {
  constexpr std::size_t kMany = 600;
  if (numbers > kMany && options.solver == StageOptions::Solver::kAuto)
    options.solver = StageOptions::Solver::kIterative;
  return options;
}

}  // namespace

void InternalVariableSystem::eval(double t, const Stage& stage, double* y, double* dydt) {
  combine(stage, y);
  ParticleView view;
  view.t = t;
  view.internal = {y, size()};
  particles_->derive(view, dydt);
}

BlockTriangularSolver::BlockTriangularSolver(const Particles& particles,
                                             std::unique_ptr<StageSolver> solver,
                                             const StageOptions& options)
    : internal_begin_(particles.layout().size()),
      system_(particles),
      internal_solver_(system_.stage_solver(for_many(options, system_.size()))),
      solver_(std::move(solver)) {}

StepStatus BlockTriangularSolver::solve(double t, double tau, const double* r, double* y) {
  const StepStatus status =
      internal_solver_->solve(t, tau, r + internal_begin_, y + internal_begin_);
  return status == StepStatus::kDone ? solver_->solve(t, tau, r, y) : status;
}

}  // namespace sim
