// The largest stable step of a method: by its own prediction, and as measured.
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
// or if the limit is an artefact of the tolerance, infinity if none up to 1e3 / rate is unstable.
// For a measured radius, so that the tolerance is far above rounding; sim::stable_step does it for
// a computed one. `rate` is of the size of the fastest eigenvalue, in 1/s, as is `damping`. The
// search takes factors of `scan`.
double largest_stable_step(const std::function<double(double h)>& radius, double rate,
                           double damping, double tolerance, double scan = 1.05);

// A step of h as a share of the largest stable one near it: 0 if any step up to 1000 h is stable,
// infinity if none down to 1e-4 h is. Cheap, and good to 1 %; not a number if it is not known.
struct StepShare {
  double share = 0;
  double radius = 0;  // of the step h itself
};
StepShare step_share(const Integrator& integrator, const Vibration& mode, double h);

// The largest stable step of a splitting, in s, for velocities that decay at that rate by forces:
// the midpoint rule of its kicks.
double kick_limit(const IntegratorInfo& info, double decay);

// The prediction of Integrator::amplification over the vibrations, or the rates; empty if the
// method does not know its own, or if all modes grow by themselves.
std::optional<double> predicted_step(const Integrator& integrator, const Spectrum& spectrum);

// A system at rest in a given state: its velocities are zero, and constant forces hold it, so that
// only a disturbance moves. A first-order system goes on as it does.
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

// Spectral radius of the derivative of one real step in the plane of the fastest mode, by
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

// The stable step by bisection on real steps; empty if nothing vibrates.
std::optional<double> measured_step(Standstill& place, const Spectrum& spectrum,
                                    const MethodChoice& method);

}  // namespace sim::study
