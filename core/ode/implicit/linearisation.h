// A LinearisedSolver from the entries of a Jacobian.
#pragma once

#include <memory>

#include "core/ode/implicit/jacobian_entries.h"
#include "core/ode/implicit/linearised_solver.h"

namespace sim {

std::unique_ptr<LinearisedSolver> make_linearised_solver(std::unique_ptr<JacobianEntries> entries);

}  // namespace sim
