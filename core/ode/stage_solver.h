// The equation that every stage of an implicit method asks for, and who solves it.
#pragma once

#include <string>
#include <vector>

#include "core/ode/outcome.h"

namespace sim {

struct StageOptions {
  double tolerance = 1e-8;  // of the residual, relative to the one at the guess
  int newton_steps = 500;   // at most; 1: one linearised step, taken as it is
  enum class Solver { kAuto, kIterative, kDirect } solver = Solver::kAuto;
  // kLocalGlobal: projective dynamics, `newton_steps` iterations with one constant matrix.
  enum class Method { kNewton, kLocalGlobal } method = Method::kNewton;
  // Where the exact Hessian is not positive definite: never use it, or only there do not.
  enum class Hessian { kExact, kClamped } hessian = Hessian::kExact;
};

//   Y - tau f(t, Y) = r  for Y
// A system that knows its structure solves it in its own way; all memory is its own.
class StageSolver {
 public:
  virtual ~StageSolver() = default;

  // y: a guess before, the solution after; tau > 0. Arrays of system.size() doubles. kNotConverged
  // when the residual stays above the tolerance, kNotFinite when a number of y is not finite.
  virtual StepStatus solve(double t, double tau, const double* r, double* y) = 0;

  virtual Effort effort() const = 0;                             // since it was made
  virtual std::vector<std::string> notes() const { return {}; }  // as Integrator::notes
};

}  // namespace sim
