// The largest stable step of a method: from what it says of itself, and from what it does.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>

#include "core/base/array.h"
#include "core/study/limits/spectrum.h"
#include "core/study/problem.h"

namespace sim::study {

// The largest h, in s, such that radius <= 1 + tolerance on all of (0, h]; 0 if no step is stable
// or if the limit is an artefact of the tolerance, infinity when none up to 1e3 / rate is unstable.
// For a radius that is measured, so that the tolerance is far above rounding; sim::stable_step does
// it for one that is computed. `rate` is of the size of the fastest eigenvalue, in 1/s, as is
// `damping`.
// It is looked for in factors of `scan`.
double largest_stable_step(const std::function<double(double h)>& radius, double rate,
                           double damping, double tolerance, double scan = 1.05);

// A step of h as a share of the largest stable one near it: 0 when any step up to 1000 h is stable,
// infinity when none down to 1e-4 h is. Cheap, and good to 1 %; not a number where it is not known.
struct StepShare {
  double share = 0;
  double radius = 0;  // of the step h itself
};
StepShare step_share(const Integrator& integrator, const Vibration& mode, double h);

// The largest stable step of a splitting, in s, for velocities that forces make decay at that rate:
// the midpoint rule of its kicks.
double kick_limit(const IntegratorInfo& info, double decay);

// From Integrator::amplification over the vibrations, or the rates; nothing when the method does
// not know its own, or where all that moves grows by itself.
std::optional<double> predicted_step(const Integrator& integrator, const Spectrum& spectrum);

// A system at a given state that stands still: its velocities are zero, and constant forces hold
// it, so that only a disturbance moves. A first-order system goes on as it does.
class Standstill {
 public:
  explicit Standstill(const Problem& problem, Simulation& system);  // at its present state

  const Problem& problem() const { return problem_; }
  Simulation& system() { return *system_; }
  std::span<const double> state() const { return x_.span(); }
  double t() const { return t_; }

 private:
  SystemSpec spec_;
  Problem problem_;
  std::optional<Simulation> system_;
  double t_;
  Array x_;
};

// Spectral radius of the derivative of one real step in the plane of the fastest mode, taken by
// differences: nothing is assumed of the method.
class MeasuredRadius {
 public:
  MeasuredRadius(Standstill& place, const Spectrum& spectrum, const MethodChoice& method);

  double operator()(double h);  // infinity when a step fails
  double tolerance() const { return tolerance_; }
  bool implicit() const { return map_.integrator().info().implicit; }

 private:
  Standstill* place_;
  const Spectrum* spectrum_;
  StepMap map_;
  double size_ = 0;       // of the disturbance, m
  double tolerance_ = 0;  // the effect of rounding and curvature on a radius of 1
  Array x_, above_, below_;
};

// By bisection on steps that are really taken; nothing when nothing vibrates.
std::optional<double> measured_step(Standstill& place, const Spectrum& spectrum,
                                    const MethodChoice& method);

}  // namespace sim::study
