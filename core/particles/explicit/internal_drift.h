// Drifts of the internal variables of forces in a splitting method.
#pragma once

#include "core/base/array.h"
#include "core/particles/particles.h"

namespace sim {

// m along m' = g(t, m) by the classical Runge-Kutta method, for variables that depend on t and
// themselves alone.
class InternalDrift {
 public:
  explicit InternalDrift(const Particles& particles);

  void drift(double t, double tau, double* state);  // from t to t + tau

 private:
  const Particles* particles_;
  Array k_[4], m_;
};

}  // namespace sim
