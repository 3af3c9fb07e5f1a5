// Steps as data: the operations, but not their order in memory. An integrator makes a plan, and a
// system turns it into a stepper that knows the structure of the system.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace sim {

// The precision in which a step is computed. States are doubles all the same.
enum class Precision { kDouble, kSingle };

// An explicit Runge-Kutta step:
//   y_i = x + h sum_{j<i} a_ij k_j,  k_i = f(t + c_i h, y_i),  x_next = x + h sum_i b_i k_i
struct ExplicitPlan {
  int stages = 0;
  std::vector<double> a, b, c;  // a row by row, stages * stages
  Precision precision = Precision::kDouble;

  double a_at(int i, int j) const { return a[static_cast<std::size_t>(i * stages + j)]; }
};

// A splitting of q' = v, v' = a(t, q) - gamma v: drift_0, kick_0, drift_1, ... kick_m-1, drift_m,
// in units of the step size h. Drifts and kicks each add up to 1; there is one drift more, any may
// be 0.
//   drift by d:  q := q + d h v
//   kick by k:   v := e^(-gamma k h) v + (1 - e^(-gamma k h)) / gamma * a(t, q)
// Both are exact flows, so that damping costs no order: with -gamma v inside an explicit kick every
// such method would be of first order. t is where the drifts so far have led.
//
// A force that depends on v in another way has no exact flow. Such kicks are explicit midpoint
// steps in v at the same q, half a kick and then the whole one with a(t, q, v) from there, which
// preserves methods of first and second order; those of higher order refuse such forces.
struct SplitPlan {
  std::vector<double> drift, kick;
  Precision precision = Precision::kDouble;
  int order = 0;

  // True if the last acceleration of a step is the first of the next: no drift lies between.
  bool closes() const { return drift.front() == 0 && drift.back() == 0 && kick.size() > 1; }
};

// A plan prepared for one system; it owns all memory that a step needs.
class Stepper {
 public:
  virtual ~Stepper() = default;

  // x_next := the state `count` steps of size h from x at t, with the bits of as many single ones;
  // count <= at_once(). False if a number of x_next is not finite.
  virtual bool step(double t, double h, int count, const double* x, double* x_next) = 0;

  // The number of steps that are cheaper together than one after the other.
  virtual int at_once() const { return 1; }
  int most_of(std::int64_t wanted) const {
    return static_cast<int>(std::min<std::int64_t>(wanted, at_once()));
  }

  // Discards what was stored of the last step, as the state has changed since.
  virtual void restart() {}

  // True if kicks are midpoint steps, see SplitPlan.
  virtual bool midpoint_kicks() const { return false; }
};

}  // namespace sim
