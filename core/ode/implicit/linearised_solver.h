// Linear equations with the Jacobian of one state, for linearly implicit methods.
#pragma once

#include "core/ode/outcome.h"

namespace sim {

// Made by a system that knows the entries of J = df/dX; all memory is its own.
class LinearisedSolver {
 public:
  virtual ~LinearisedSolver() = default;

  virtual void linearise(double t, const double* x) = 0;  // J := df/dX there
  // Factors of I - tau J, tau > 0; false where that is singular or a number of it is not finite.
  virtual bool factorise(double tau) = 0;
  virtual void solve(double* x) = 0;  // x := (I - tau J)^-1 x, by these factors

  virtual Effort effort() const = 0;  // since it was made
};

}  // namespace sim
