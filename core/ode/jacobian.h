// The Jacobian J = df/dX at one point of state space, as a linear operator.
#pragma once

#include <memory>

namespace sim {

class OdeSystem;

class Jacobian {
 public:
  virtual ~Jacobian() = default;

  // Chooses the point; x must stay as it is until the last apply().
  virtual void at(double t, const double* x) = 0;

  // df := J dx. Arrays of system.size() doubles that do not overlap.
  virtual void apply(const double* dx, double* df) = 0;
};

// By central differences of f, for any system; about 1e-10 relative.
std::unique_ptr<Jacobian> difference_jacobian(OdeSystem& system);

}  // namespace sim
