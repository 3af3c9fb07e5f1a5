// The equation of the stages of implicit methods, and the interface of its solvers.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/ode/outcome.h"

namespace sim {

struct StageOptions {
  // The tolerance of the residual, relative to the one at the guess; 0: it follows from the error
  // of the step itself, so that a method of this order loses a small part of its accuracy.
  double tolerance = 0;
  int order = 1;
  // The tolerance of solutions, in each number: |error| <= part of (atol + rtol |y|), for methods
  // that keep a tolerance of their own; 0: see `tolerance`.
  double atol = 0, rtol = 0;
  double reach = 1;          // the step ends at  r + reach (Y - r)  where it ends at no stage
  int newton_steps = 10000;  // at most; 1: one linearised step, taken as it is
  bool long_steps = false;   // steps are long beside the motion: a factorisation pays
  enum class Solver { kAuto, kIterative, kDirect } solver = Solver::kAuto;
  // kLocalGlobal: projective dynamics, `newton_steps` iterations with one constant matrix.
  enum class Method { kNewton, kLocalGlobal } method = Method::kNewton;
  // The geometric stiffness of compressed springs: exact if that leaves the Hessian positive
  // definite, else reduced; or never.
  enum class Hessian { kExact, kClamped } hessian = Hessian::kExact;
};

// Solves
//   Y - tau f(t, Y) = r  for Y.
// A system that knows its structure solves it in its own way; all memory is its own.
class StageSolver {
 public:
  virtual ~StageSolver() = default;

  // y: a guess before, the solution after; tau > 0. Arrays of system.size() doubles. kNotConverged
  // if the residual stays above the tolerance, kNotFinite if a number of y is not finite.
  virtual StepStatus solve(double t, double tau, const double* r, double* y) = 0;

  // Discard, save and restore what is stored of earlier solutions, such as a factorisation: the
  // next solutions have the same bits. They are called by Integrator::restart(), memory() and
  // recall().
  virtual void restart() {}
  virtual std::vector<double> memory() const { return {}; }
  virtual void recall(std::span<const double> /*memory*/) {}

  virtual Effort effort() const = 0;                             // since it was made
  virtual std::vector<std::string> notes() const { return {}; }  // as Integrator::notes
};

}  // namespace sim
