// Keeps particles out of colliders inside the steps of explicit methods.
#pragma once

#include <array>
#include <cstring>
#include <memory>
#include <vector>

#include "core/ode/ode_system.h"
#include "core/particles/explicit/extent.h"
#include "core/particles/explicit/lying.h"
#include "core/particles/particles.h"

namespace sim {

// Local to a particle: the same bits whatever the number of threads and the pieces in which it is
// done. Pinned particles never move.
class Settling {
 public:
  using In = std::array<const double*, 3>;  // a coordinate each
  using Out = std::array<double*, 3>;

  // Of a method of first order, whose velocities belong to another moment: late_work().
  explicit Settling(Particles& particles, bool first_order = false);

  // Before the steps from t on; t1: their end.
  void begin(double t, double t1);
  // After them: false where a particle was squeezed between colliders.
  bool succeeded() const { return particles_->contacts().ledger().squeezed() < 0; }

  // Of the particles [begin, end), at the end of a step of any method from q0, v0 to q, v. The way
  // of a particle is the cubic through both ends.
  void end(double t, double h, const In& q0, const In& v0, const Out& q, const Out& v, int begin,
           int end);

  // The same in two halves for a kick, a drift and a kick. After the drift from q0 to q by the
  // velocities v; those at the start were v0:
  //   p(s) = q0 + s h v0 + s^2 (q - q0 - h v0)
  void drifted(double t, double h, const In& q0, const In& v0, const Out& q, const Out& v,
               int begin, int end);
  // Will any of [begin, end) be held after the second kick? begin: a multiple of 8.
  bool will_hold(int begin, int end) const {
    int i = begin;
    for (; i + 4 * kLanes <= end; i += 4 * kLanes)
      if ((pressed_by(i) | pressed_by(i + kLanes) | pressed_by(i + 2 * kLanes) |
           pressed_by(i + 3 * kLanes)) != 0)
        return true;
    for (; i < end; i += kLanes)
      if (pressed_by(i) != 0) return true;
    return false;
  }
  // After the second kick, at time t, those that are pressed on; and what follows from a velocity
  // that was held, as if it had been so before. Of `kick` all but surface and friction is given.
  void kicked(double t, LyingKick kick, int begin, int end);

 private:
  static constexpr int kLanes = 8;

  struct Room {
    Vec3 middle, half;   // m, of the box that particles are in
    double longest = 0;  // m, of their ways
  };

  struct Close;

  Room room_of(const LyingStep& step, int begin, int end) const;
  Close close_to(double t, double h, const Room& room) const;
  int alone(double t, const Room& room, LyingStep& step) const;
  void settle(double t, LyingStep& step, int begin, int end);
  void settle_one(double t, const LyingStep& step, int i);
  void enter(const LyingStep& step, int i, unsigned bits, const Lying& lying);
  std::uint64_t pressed_by(int i) const {  // of eight particles
    std::uint64_t bytes;
    std::memcpy(&bytes, pressed_.data() + i, sizeof bytes);
    return bytes;
  }
  void hold_one(double t, const LyingKick& kick, int i);

  struct Free;  // where particles are before they are settled
  void enter_late(const LyingStep& step, const Free& free, int begin, int end);

  Particles* particles_;
  bool first_order_;
  ExtentOf extent_of_ = extent_of();
  LyingKernels lying_ = lying_kernels();
  // Of each particle: 0, kSingly, or which of the colliders presses it alone, from kAlone on.
  std::vector<std::uint8_t> pressed_;
};

// Steps of a stepper that keeps nothing of them, settled at their ends.
class SettledStepper final : public Stepper {
 public:
  SettledStepper(Particles& particles, std::unique_ptr<Stepper> stepper, bool first_order)
      : particles_(&particles), settling_(particles, first_order), stepper_(std::move(stepper)) {}

  bool step(double t, double h, int count, const double* x, double* x_next) override;
  void restart() override { stepper_->restart(); }

 private:
  Particles* particles_;
  Settling settling_;
  std::unique_ptr<Stepper> stepper_;
};

}  // namespace sim
