// Energy against what the forces allow: gravity and springs keep it, drag may only take.
#pragma once

#include "core/study/problem.h"

namespace sim::study {

// E(t) + W(t) - E(0), where W is what drag has taken, the integral of c |v|^2. It is 0 for the
// exact motion; looked at at equal intervals of time, W by Simpson's rule, so at every second look.
class EnergyBalance {
 public:
  // Looks at the present state of a second-order system, which it outlives.
  explicit EnergyBalance(Simulation& system);

  void look();  // at the present state

  // No force but gravity, springs and drag, so that E and W say all.
  bool complete() const { return complete_; }
  bool has_drag() const { return damping_ > 0; }

  double error() const { return error_; }      // J, of the largest size so far, with its sign
  double taken() const { return taken_; }      // W, J
  double in_play() const { return in_play_; }  // largest kinetic energy + change of potential, J

 private:
  double power() const;  // of the drag, W

  Simulation* system_;
  double damping_ = 0;  // kg/s
  bool complete_ = true;
  Energy start_;
  double last_t_ = 0, last_power_ = 0, middle_power_ = 0;
  bool odd_ = false;
  double taken_ = 0, error_ = 0, in_play_ = 0;
};

}  // namespace sim::study
