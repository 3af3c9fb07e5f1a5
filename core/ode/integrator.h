// One step of a numerical method on X' = f(t, X). Knows no physics.
#pragma once

#include "core/ode/ode_system.h"

namespace sim {

struct IntegratorInfo {
  int order = 0;                    // p: the global error is O(h^p)
  int evaluations = 0;              // of f, per step
  bool needs_second_order = false;  // q' = v, v' = a(t, q) - gamma v: OdeSystem::split_stepper
};

struct StepResult {
  double taken = 0;    // 0 = rejected
  double next = 0;     // the step to try next
  bool finite = true;  // every number of x_next is finite
};

class Integrator {
 public:
  virtual ~Integrator() = default;

  virtual IntegratorInfo info() const noexcept = 0;

  // Takes all memory that step() will use; called once before the first step.
  virtual void prepare(OdeSystem& system) = 0;

  // x_next := the state at t + h from the state x at t; x and x_next are different arrays of
  // system.size() doubles. x keeps its bits, so the last good state is never lost.
  virtual StepResult step(OdeSystem& system, double t, double h, const double* x,
                          double* x_next) = 0;

  // Forgets what was kept of the last step; called when the state was changed in between.
  virtual void restart() {}
};

}  // namespace sim
