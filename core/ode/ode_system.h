// The interface of systems X' = f(t, X), through which alone integrators see a scene.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/array.h"
#include "core/base/cancellation.h"
#include "core/ode/embedded_stepper.h"
#include "core/ode/events.h"
#include "core/ode/implicit/implicit_explicit.h"
#include "core/ode/implicit/linearised_solver.h"
#include "core/ode/jacobian.h"
#include "core/ode/plan.h"
#include "core/ode/stage_solver.h"
#include "core/ode/state_shape.h"

namespace sim {

// A point of state space that is not formed yet: x + sum_j coef_j * k_j.
// Left unevaluated so that a system may form, evaluate and store it piece by piece in cache.
struct Stage {
  struct Term {
    double coef;
    const double* k;
  };
  const double* x;
  std::span<const Term> terms;
};

// x + scale sum_j weights_j k_j over the weights that are not zero; the terms are put into `terms`,
// which has room for as many as there are weights and outlives the stage.
Stage weighted(const double* x, double scale, std::span<const double> weights,
               std::span<const Array> k, std::span<Stage::Term> terms);

// out[i] := stage for begin <= i < end; the terms are added in order, whatever the range and the
// instruction set.
using CombineRange = void (*)(const Stage& stage, double* out, std::size_t begin, std::size_t end);
CombineRange combine_range();  // the one for this machine

// The right-hand side. Pure: the same (t, X) gives the same bits, whatever the number of threads.
// Every array has size() doubles and is aligned to 64 bytes.
class OdeSystem {
 public:
  virtual ~OdeSystem() = default;

  virtual std::size_t size() const noexcept = 0;

  // The layout of the numbers of X; by default a flat list.
  virtual StateShape shape() const { return StateShape::flat(size()); }

  // y := stage, dydt := f(t, y). y and dydt overlap neither each other nor the stage.
  virtual void eval(double t, const Stage& stage, double* y, double* dydt) = 0;

  // out := stage; out may be stage.x or one of the k.
  virtual void combine(const Stage& stage, double* out) = 0;

  // Explicit Runge-Kutta methods leave the order of work to the system, which knows the
  // dependencies between stages. By default stage after stage, each over all of X. Throws
  // Error{kScene} for a precision that the system does not have.
  virtual std::unique_ptr<Stepper> explicit_stepper(const ExplicitPlan& plan);

  // The stages of an embedded pair are left to the system, too.
  virtual std::unique_ptr<EmbeddedStepper> embedded_stepper(const EmbeddedPlan& plan);

  // Splitting methods need the structure q' = v, v' = a(t, q) - gamma v; null without it.
  virtual std::unique_ptr<Stepper> split_stepper(const SplitPlan& /*plan*/) { return nullptr; }

  // Implicit methods leave their equations to the system. By default Newton's method with a dense
  // Jacobian; throws Error when X has too many numbers for that.
  virtual std::unique_ptr<StageSolver> stage_solver(const StageOptions& options);

  // Linear equations with df/dX for linearly implicit methods. By default with all entries, by
  // differences; null when X has too many numbers for that, or not all states are allowed.
  virtual std::unique_ptr<LinearisedSolver> linearised_solver();

  // The stepper of methods that are implicit in stiff forces alone; null without that structure.
  virtual std::unique_ptr<ImplicitExplicitStepper> implicit_explicit_stepper(
      const ImplicitExplicitPlan& /*plan*/) {
    return nullptr;
  }

  // df/dX; by differences unless the system knows better. The system outlives it.
  virtual std::unique_ptr<Jacobian> jacobian() { return difference_jacobian(*this); }

  // True if some states are not allowed, as a particle within an obstacle. Steppers of the system
  // then keep to the allowed ones by themselves; others are refused when they are made.
  virtual bool has_inequalities() const noexcept { return false; }
  // True if something acts between steps: methods with steps of their own do not fit.
  virtual bool is_changed_between_steps() const noexcept { return false; }
  // Projects a state that is nearly allowed onto the allowed ones if these are a manifold in the
  // space of states, as for particles on rods: methods without steppers of the system call it at
  // the ends of their steps. False if that fails.
  virtual bool project(double /*t*/, double* /*x*/) { return true; }
  // Frames the stages of a step of size h from x, for methods that leave their equations to a
  // StageSolver: the stages begin at the result of begin_step, and are repeated, with `again`, if
  // end_step asks for it. The contact forces at the boundary of the allowed states are found in
  // between.
  virtual const double* begin_step(double /*t*/, double /*h*/, const double* x, bool /*again*/) {
    return x;
  }
  virtual StepEnd end_step(double t, double h, const double* /*x*/, double* x_next) {
    return project(t + h, x_next) ? StepEnd::kAccepted : StepEnd::kNotAllowed;
  }
  virtual bool had_impact() const { return false; }  // in that step: before it is no history
  virtual Events* events() { return nullptr; }       // for methods that cut their steps; null: none
  // The reason why the last step found no allowed state; empty if it found one.
  virtual std::string refusal() const { return {}; }

  // Notes for the user, one sentence each.
  virtual std::vector<std::string> notes() const { return {}; }

  // Sets a function that is polled within long steps: true ends such a step with kStopped.
  void stop_when(std::function<bool()> stop) { cancellation_.when(std::move(stop)); }
  bool stopped() const { return cancellation_.requested(); }
  // True after the present step was given up: evaluations since then mean nothing, and methods end
  // the step with kStopped.
  bool gave_up() const { return cancellation_.given_up(); }
  Cancellation& cancellation() { return cancellation_; }

 private:
  Cancellation cancellation_;
};

}  // namespace sim
