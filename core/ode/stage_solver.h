// The equation that every stage of an implicit method asks for, and who solves it.
#pragma once

#include <string>
#include <vector>

#include "core/ode/outcome.h"

namespace sim {

struct StageOptions {
  // Of the residual, relative to the one at the guess; 0: by what the step itself can be off, so
  // that a method of this order loses a small part of its accuracy.
  double tolerance = 0;
  int order = 1;
  double reach = 1;          // the step ends at  r + reach (Y - r)  where it ends at no stage
  int newton_steps = 10000;  // at most; 1: one linearised step, taken as it is
  enum class Solver { kAuto, kIterative, kDirect } solver = Solver::kAuto;
  // kLocalGlobal: projective dynamics, `newton_steps` iterations with one constant matrix.
  enum class Method { kNewton, kLocalGlobal } method = Method::kNewton;
  // What compressed springs push across their length: as it is where that leaves the Hessian
  // positive definite, else less; or never.
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
