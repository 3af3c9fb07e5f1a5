// Keeps particles out of colliders inside the steps of explicit methods.
#pragma once

#include <array>
#include <cstring>
#include <memory>
#include <vector>

#include "core/ode/ode_system.h"
#include "core/particles/explicit/extent.h"
#include "core/particles/particles.h"

namespace sim {

// Local to a particle: the same bits whatever the number of threads and the pieces in which it is
// done. Pinned particles never move.
class Settling {
 public:
  using In = std::array<const double*, 3>;  // a coordinate each
  using Out = std::array<double*, 3>;

  explicit Settling(Particles& particles);

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
  // Of [begin, end) the first that will be held after the second kick, or end.
  int next_held(int begin, int end) const {
    const std::uint8_t* const from = pressed_.data() + begin;
    const void* const at = std::memchr(from, 1, static_cast<std::size_t>(end - begin));
    return at ? begin + static_cast<int>(static_cast<const std::uint8_t*>(at) - from) : end;
  }
  // After the second kick, at time t. changed(i) hears of every particle that was held.
  template <class Changed>
  void kicked(double t, const In& q, const Out& v, int begin, int end, const Changed& changed) {
    for (int i = next_held(begin, end); i < end; i = next_held(i + 1, end)) {
      const Vec3 before(v[0][i], v[1][i], v[2][i]);
      const Vec3 held = hold(t, i, Vec3(q[0][i], q[1][i], q[2][i]), before);
      for (std::size_t axis = 0; axis < 3; ++axis) v[axis][i] = held[axis];
      changed(i);
    }
  }

 private:
  bool near(double t, double h, const In* from, const In& v0, const Out& q, const Out& v, int begin,
            int end) const;
  template <class WayOf>
  void settle(double t, double h, const In* from, const In& v0, const Out& q, const Out& v,
              int begin, int end, bool hold_too, const WayOf& way_of);
  Vec3 hold(double t, int i, const Vec3& q, const Vec3& v);

  Particles* particles_;
  ExtentOf extent_of_ = extent_of();
  std::vector<std::uint8_t> pressed_;  // of each particle, 0 or 1
};

// Steps of a stepper that keeps nothing of them, settled at their ends.
class SettledStepper final : public Stepper {
 public:
  SettledStepper(Particles& particles, std::unique_ptr<Stepper> stepper)
      : particles_(&particles), settling_(particles), stepper_(std::move(stepper)) {}

  bool step(double t, double h, int count, const double* x, double* x_next) override;
  void restart() override { stepper_->restart(); }

 private:
  Particles* particles_;
  Settling settling_;
  std::unique_ptr<Stepper> stepper_;
};

}  // namespace sim
