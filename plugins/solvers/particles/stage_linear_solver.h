// The choice of a solver for the linear equations of a Newton step.
#pragma once

#include <memory>

#include "core/ode/ode_system.h"
#include "linear_solver.h"
#include "stage_matrix.h"

namespace sim {

// A solver that suits the system, or the one that the options require. `bounded`: inequalities may
// restrict the matrix, which outlives the solver. Throws Error{kScene} if that does not fit.
std::unique_ptr<LinearSolver> make_linear_solver(StageMatrix& matrix, const Particles& system,
                                                 const StageOptions& options, bool bounded);

}  // namespace sim
