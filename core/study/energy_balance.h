// Energy against what the forces allow: gravity and springs keep it, damping may only take.
#pragma once

#include <cstdint>

#include "core/study/problem.h"

namespace sim::study {

// E(t) + W(t) - E(0), where W is what drag and damped springs have taken, the integral of their
// power; 0 for the exact motion. W by Simpson's rule over two steps; after an odd number of them
// only E is looked at, which must not have risen.
class EnergyBalance {
 public:
  // Looks at the present state of a second-order system, which it outlives.
  explicit EnergyBalance(Simulation& system);

  // After steps, at most due() of them: in large systems not after every one, for it would cost.
  void advance(std::int64_t steps = 1);
  std::int64_t due() const;  // steps until the present state is wanted again

  void look() { look(system_->energy()); }  // at the present state
  void look(const Energy& now);             // ... whose energy is known

  // No force but gravity, springs and drag, so that E and W say all.
  bool complete() const { return complete_; }
  bool has_drag() const { return damped_; }  // of particles or of springs
  // J, how well W is known: twice what Simpson's rule and the trapezoidal rule differ by; infinite
  // after fewer than six steps with drag.
  double uncertainty() const;

  double error() const { return error_; }      // J, of the largest size so far, with its sign
  double taken() const { return taken_; }      // W, J
  double in_play() const { return in_play_; }  // largest kinetic energy + change of potential, J
  double rise() const { return rise_; }        // largest E - E(0), J

 private:
  double power();  // of the damping, W

  Simulation* system_;
  bool damped_ = false;
  Array sums_;  // for power()
  bool complete_ = true;
  Energy start_;
  std::int64_t stride_ = 1, steps_ = 0, pairs_ = 0;
  double t_[2] = {}, power_[2] = {};  // where the last pair ended, and one further
  bool open_ = false;                 // a pair has begun
  double taken_ = 0, taken_by_trapezoids_ = 0;
  double error_ = 0, in_play_ = 0, rise_ = 0;
};

}  // namespace sim::study
