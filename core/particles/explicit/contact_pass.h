// Contact of particles with colliders inside the steps of explicit methods.
#pragma once

#include <array>
#include <cstring>
#include <memory>
#include <vector>

#include "core/ode/ode_system.h"
#include "core/particles/particles.h"

namespace sim {

struct RestingContactStep;  // core/particles/explicit/resting_contact_kernel.h
struct RestingContactKick;
struct RestingContactBlock;

// Contact is local to a particle: the same bits for any number of threads and blocks. Pinned
// particles never move.
class ParticleContactPass {
 public:
  using In = std::array<const double*, 3>;  // a coordinate each
  using Out = std::array<double*, 3>;

  // first_order: of a method of first order, whose velocities belong to another time: late_work().
  explicit ParticleContactPass(Particles& particles, bool first_order = false);

  // Called before the steps from t on; t1: their end.
  void begin(double t, double t1);
  // Called after them: false if a particle was over-constrained.
  bool succeeded() const { return particles_->contacts().work_sums().over_constrained() < 0; }

  // Resolves contact of the particles [begin, end) at the end of a step of any method from q0, v0
  // to q, v. The path of a particle is the cubic through both ends.
  void end(double t, double h, const In& q0, const In& v0, const Out& q, const Out& v, int begin,
           int end);

  // The same in two halves for a kick, a drift and a kick. After the drift from q0 to q by the
  // velocities v, with the velocities v0 at the start, the path is
  //   p(s) = q0 + s h v0 + s^2 (q - q0 - h v0)
  void resolve_after_drift(double t, double h, const In& q0, const In& v0, const Out& q,
                           const Out& v, int begin, int end);
  // True if any of [begin, end) has a resting contact after the second kick; begin: a multiple of
  // 8.
  bool any_resting(int begin, int end) const {
    int i = begin;
    for (; i + 4 * kLanes <= end; i += 4 * kLanes)
      if ((resting_mask(i) | resting_mask(i + kLanes) | resting_mask(i + 2 * kLanes) |
           resting_mask(i + 3 * kLanes)) != 0)
        return true;
    for (; i < end; i += kLanes)
      if (resting_mask(i) != 0) return true;
    return false;
  }
  // After the second kick, at time t: constrains the velocities of resting contacts, and updates
  // what depends on them. `kick` is complete but for surface and friction.
  void constrain_after_kick(double t, RestingContactKick kick, int begin, int end);

 private:
  static constexpr int kLanes = 8;

  struct BlockExtent {
    Vec3 middle, half;   // m, of the box that particles are in
    double longest = 0;  // m, of their paths
  };

  struct NearbyColliders;

  BlockExtent extent_of_block(const RestingContactStep& step, int begin, int end) const;
  NearbyColliders colliders_near(double t, double h, const BlockExtent& room) const;
  int alone(double t, const BlockExtent& room, RestingContactStep& step) const;
  void resolve(double t, RestingContactStep& step, int begin, int end);
  void resolve_one(double t, const RestingContactStep& step, int i);
  void enter(const RestingContactStep& step, int i, unsigned bits,
             const RestingContactBlock& block);
  std::uint64_t resting_mask(int i) const {  // of eight particles
    std::uint64_t bytes;
    std::memcpy(&bytes, resting_by_.data() + i, sizeof bytes);
    return bytes;
  }
  void constrain_one(double t, const RestingContactKick& kick, int i);

  struct Free;  // the positions before contact
  void record_late_work(const RestingContactStep& step, const Free& free, int begin, int end);

  Particles* particles_;
  bool first_order_;
  struct Kernels;
  std::shared_ptr<const Kernels> kernels_;
  // For each particle: 0, kSingly, or the only collider on which it rests, from kAlone on.
  std::vector<std::uint8_t> resting_by_;
};

// A stepper without memory of its steps, followed by the contact pass at the end of each.
class ContactStepper final : public Stepper {
 public:
  ContactStepper(Particles& particles, std::unique_ptr<Stepper> stepper, bool first_order)
      : particles_(&particles),
        contact_pass_(particles, first_order),
        stepper_(std::move(stepper)) {}

  bool step(double t, double h, int count, const double* x, double* x_next) override;
  void restart() override { stepper_->restart(); }

 private:
  Particles* particles_;
  ParticleContactPass contact_pass_;
  std::unique_ptr<Stepper> stepper_;
};

}  // namespace sim
