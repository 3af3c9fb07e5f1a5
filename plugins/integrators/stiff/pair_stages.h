// The stages of an embedded pair for stiff systems: one trial step.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/ode/ode_system.h"

namespace sim {

class PairStages {
 public:
  virtual ~PairStages() = default;

  // Takes the memory of all later steps, as Integrator::prepare() does.
  virtual void prepare(OdeSystem& system) = 0;
  virtual void restart() {}  // the state was changed since the last step

  // y := the state after h from x at t, error := what the pair says that y is off. slope: f(t, x).
  virtual StepStatus step(OdeSystem& system, double t, double h, const double* x,
                          const double* slope, double* y, double* error) = 0;
  // slope := f(t + h, y) at the end of that step.
  virtual void last_slope(OdeSystem& system, double t, double h, const double* y,
                          double* slope) = 0;

  // The numbers that the next step depends on besides state and slope.
  virtual std::vector<double> memory() const { return {}; }
  virtual void recall(std::span<const double> /*memory*/) {}
  virtual Effort effort() const = 0;
  virtual std::vector<std::string> notes() const { return {}; }
  // The spectral radius of one step, see Integrator::amplification().
  virtual double amplification(double h_omega, double h_gamma) const = 0;
};

}  // namespace sim
