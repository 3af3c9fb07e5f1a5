// The stages of an embedded pair for stiff systems: one trial step.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/ode/ode_system.h"

namespace sim {

// A step of size h from x to y, and the slopes at both.
struct PairStep {
  double h;
  std::span<const double> x, slope, y, last_slope;
};

class PairStages {
 public:
  virtual ~PairStages() = default;

  // Takes the memory of all later steps, as Integrator::prepare() does.
  virtual void prepare(OdeSystem& system) = 0;
  virtual void restart() {}  // the state was changed since the last step

  // y := the state after h from x at t, error := what the pair says that y is off. slope: f(t, x).
  virtual StepStatus step(OdeSystem& system, double t, double h, const double* x,
                          const double* slope, double* y, double* error) = 0;
  // slope := f(t + h, y) at the end of that step, which is accepted.
  virtual void last_slope(OdeSystem& system, double t, double h, const double* y,
                          double* slope) = 0;
  // out := the state theta of the way through the accepted step. By default the cubic of Hermite,
  //   x + theta (y - x) + theta (1 - theta) ((1 - theta) (h k - (y - x)) - theta (h l - (y - x)))
  // which is off by theta^2 (1 - theta)^2 h^4 x^(4) / 24 where the slopes k and l are as good as
  // states: those of solved equations are.
  virtual void interpolate(double theta, const PairStep& step, double* out) const;
  // out := the state h after `step` began at t, by a step of that size; false where interpolate()
  // is as good. The accepted step stays what it is.
  virtual bool step_inside(OdeSystem& /*system*/, double /*t*/, double /*h*/,
                           const PairStep& /*step*/, double* /*out*/) {
    return false;
  }

  // The numbers that the next step depends on besides state and slope.
  virtual std::vector<double> memory() const { return {}; }
  // False: these numbers are no memory of this method, and it begins anew.
  virtual bool recall(std::span<const double> memory) { return memory.empty(); }
  virtual Effort effort() const = 0;
  virtual std::vector<std::string> notes() const { return {}; }
  // The spectral radius of one step, see Integrator::amplification().
  virtual double amplification(double h_omega, double h_gamma) const = 0;
};

inline void PairStages::interpolate(double theta, const PairStep& step, double* out) const {
  const double rest = 1 - theta;
  for (std::size_t i = 0; i < step.x.size(); ++i) {
    const double change = step.y[i] - step.x[i];
    const double bend =
        rest * (step.h * step.slope[i] - change) - theta * (step.h * step.last_slope[i] - change);
    out[i] = step.x[i] + theta * change + theta * rest * bend;
  }
}

}  // namespace sim
