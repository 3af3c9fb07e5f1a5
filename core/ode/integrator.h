// The interface of integrators: steps of a numerical method on X' = f(t, X), without any physics.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/ode/ode_system.h"

namespace sim {

struct IntegratorInfo {
  int order = 0;                    // p: the global error is O(h^p); 0 = not chosen yet
  int evaluations = 0;              // of f, per step (of its own, if adaptive); 0 = varies
  bool needs_second_order = false;  // q' = v, v' = a(t, q) - gamma v: OdeSystem::split_stepper
  bool adaptive = false;            // takes steps of its own size inside one of size h
  bool symplectic = false;          // without damping
  bool implicit = false;            // solves equations in each step
  Precision precision = Precision::kDouble;
};

class Integrator {
 public:
  virtual ~Integrator() = default;

  virtual IntegratorInfo info() const noexcept = 0;

  // Takes all memory that advance() will use; called once, before the first restart().
  virtual void prepare(OdeSystem& system) = 0;

  // Announces the step size, of which a step may be a part: after prepare() and when the step of a
  // run is changed, before the restart() that follows.
  virtual void set_step_size(double /*h*/) {}

  // Takes steps of size h from the state x at t, at least one and at most `most`, as many as are
  // cheaper together: x_next := the state after them, with the bits of as many single steps. x and
  // x_next are different arrays of system.size() doubles; x keeps its bits, so that the last good
  // state is never lost. If one of several steps fails, none is taken: ask for one to see it fail.
  virtual Advance advance(OdeSystem& system, double t, double h, std::int64_t most, const double* x,
                          double* x_next) = 0;

  // Takes a single step.
  StepStatus step(OdeSystem& system, double t, double h, const double* x, double* x_next) {
    return advance(system, t, h, 1, x, x_next).status;
  }

  // Announces steps of size h from the state x at t, at the start of a run or after the state or h
  // was changed: discards what was stored of the last step. May take memory.
  virtual void restart(double /*t*/, double /*h*/, const double* /*x*/) {}

  // The history of the last steps, which a restart would not reproduce bit for bit; recall()
  // restores it. Empty for one-step methods. Together with X it is all that the next step depends
  // on.
  virtual std::vector<double> memory() const { return {}; }
  virtual void recall(std::span<const double> /*memory*/) {}

  virtual Effort effort() const { return {}; }

  // Notes for the user on this method and this system, one sentence each; after prepare().
  virtual std::vector<std::string> notes() const { return {}; }

  // Spectral radius of one step on q'' = -omega^2 q - gamma q' with h omega and h gamma: stable
  // where it is <= 1. Not a number when the method does not know.
  virtual double amplification(double /*h_omega*/, double /*h_gamma*/) const {
    return std::numeric_limits<double>::quiet_NaN();
  }

  // The part of f whose fastest mode limits the step by that radius; null: all of f.
  virtual OdeSystem* limiting_part() const { return nullptr; }
};

}  // namespace sim
