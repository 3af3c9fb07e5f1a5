// Keeps particles out of colliders inside the steps of explicit methods.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "core/ode/ode_system.h"
#include "core/particles/particles.h"

namespace sim {

// Local to a particle: the same bits whatever the number of threads. Pinned particles never move.
class Settling {
 public:
  explicit Settling(Particles& particles);

  // At the end of a step of any method. The way of a particle is the cubic through both ends:
  //   p(0) = x, p'(0) = h v, p(1) = x_next, p'(1) = h v_next
  // True when some particle touched something.
  bool end(double t, double h, const double* x, double* x_next);

  // The same in two halves for a kick, a drift and a kick. After the drift x_next has the positions
  // of the end and the velocities of the drift:
  //   p(s) = x + s h v + s^2 (x_next - x - h v)
  void drifted(double t, double h, const double* x, double* x_next);
  void kicked(double t, double* x_next);  // t: of the end

 private:
  template <class WayOf>
  bool settle(double t, double h, const double* x, double* x_next, bool hold, const WayOf& way_of);

  Particles* particles_;
  std::vector<std::uint8_t> near_, pressed_;  // of each particle
  std::atomic<bool> touched_{false};
};

// Steps of a stepper that keeps nothing of them, settled at their ends.
class SettledStepper final : public Stepper {
 public:
  SettledStepper(Particles& particles, std::unique_ptr<Stepper> stepper)
      : settling_(particles), stepper_(std::move(stepper)) {}

  bool step(double t, double h, int count, const double* x, double* x_next) override {
    if (!stepper_->step(t, h, count, x, x_next)) return false;
    settling_.end(t, h, x, x_next);
    return true;
  }
  void restart() override { stepper_->restart(); }

 private:
  Settling settling_;
  std::unique_ptr<Stepper> stepper_;
};

}  // namespace sim
