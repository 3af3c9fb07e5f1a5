// Accelerations of constrained particles with resting contacts on colliders.
#pragma once

#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/particles/constraints/active_set_contact_solver.h"
#include "core/particles/particles.h"

namespace sim {

// A resting contact of a particle on a surface.
struct RestingContact {
  int particle = 0;
  Collider* collider = nullptr;
  bool slides = false;     // friction acts against its slip; else it holds what it can
  Vec3 slip{0, 0, 0};      // m/s, along the surface
  double surplus = 0;      // m/s^2, by which it is pressed; < 0: it leaves
  ContactWork power = {};  // W, of the surface on it
};

class ContactAccelerations {
 public:
  // count: of the particles that touch colliders, the first.
  ContactAccelerations(Particles& particles, const Constraints& constraints, int count);

  struct Evaluation {
    double difference_step = 0;  // s, for differences; < 0: backwards
    bool has_friction = true;    // there is friction
  };
  // a: free accelerations at this state, and then those of what is held, with J a = -bias, and
  // gap'' >= 0 of what lies, which surfaces push and never pull. values: of the rows there. False
  // where there are none such.
  bool accelerate(const ParticleView& now, const RowValues& values,
                  std::span<const RestingContact> resting, const Evaluation& look,
                  const Constraints::Axes& a);
  // The contact forces of the last call, N, one for each resting contact, in their order.
  std::span<const ContactForce> contacts() const { return contacts_; }
  // m/s^2 by which it presses, or < 0: with which it leaves.
  double surplus(std::size_t k) const;
  std::span<const double> multipliers() const { return solver_.multipliers(); }  // N, of each row

  // a := free accelerations at a state, of particles that are led, too.
  void free(const ParticleView& now, const Constraints::Axes& a) const;

  // N, of each row at a state, for those who look; without surfaces where that has no end.
  std::span<const double> multipliers(const ParticleView& now, const RowValues& values);

 private:
  void find(const ParticleView& now);

  Particles* particles_;
  const Constraints* constraints_;
  int count_;
  ActiveSetContactSolver solver_;
  Array a_;
  std::vector<RestingContact> resting_;
  std::vector<ContactForce> contacts_;
};

}  // namespace sim
