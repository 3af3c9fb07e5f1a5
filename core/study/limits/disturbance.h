// The growth of a small disturbance of a system at rest under a method: many real steps, from a
// random direction, so that no mode is presumed.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/study/limits/step_limit.h"

namespace sim::study {

class Disturbance {
 public:
  // A disturbance of the particles of a second-order system, at the state of `place`.
  Disturbance(Standstill& place, const Spectrum& spectrum, const MethodChoice& method);

  // Growth in one step of size h, beyond the growth of the system itself: the largest size seen in
  // the last quarter of some hundred steps relative to that in the second; 1 for a drift. Infinity
  // if a step fails.
  double operator()(double h);

  // Growth below 1 + this counts as none; for a method of several steps a tenth of it.
  static constexpr double kTolerance = 1e-3;
  double tolerance() const { return keeps_steps_ ? 0.1 * kTolerance : kTolerance; }

  // True if the method keeps more than a state from step to step, so that single steps say little
  // of it.
  bool keeps_steps() const { return keeps_steps_; }

 private:
  struct Grown {
    double growth, ratio;  // in one step; of the last quarter to the second
  };
  struct Course {
    std::unique_ptr<Integrator> integrator;
    Array x, next;
  };
  Course course() const;
  void begin(Course& course, std::span<const double> x, double h) const;
  bool step(Course& course, int step, double h) const;  // false if it fails

  Grown growth_in(int steps, double h);
  bool forces_change() const;
  double size_of(std::span<const double> x, std::span<const double> from) const;

  Standstill* place_;
  MethodChoice method_;
  std::vector<double> weights_;  // of each number of X, the energy of its disturbance
  double own_ = 0;               // 1/s, the largest growth of the system itself
  Array start_;
  Course disturbed_;
  std::optional<Course> undisturbed_;  // where forces of time move what is at rest
  bool keeps_steps_ = false;
};

// The limit by single steps in one plane, lowered if a random disturbance grows below it. For
// methods of several steps the disturbance alone counts.
double limit_by_disturbance(Disturbance& growth, double limit);

}  // namespace sim::study
