// Accelerations of constrained particles with resting contacts on colliders.
#pragma once

#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/particles/constraints/active_set_contact_solver.h"
#include "core/particles/support_surface.h"
#include "core/particles/particles.h"

namespace sim {

// A resting contact of a particle on a surface.
struct RestingContact {
  int particle = 0;
  SupportSurface surface;
  bool slides = false;     // kinetic friction against its slip; otherwise static
  Vec3 slip{0, 0, 0};      // m/s, along the surface
  double surplus = 0;      // m/s^2, by which it is pressed on; < 0: it separates
  ContactWork power = {};  // W, of the surface on it
};

class ContactAccelerations {
 public:
  // count: of the particles with contact, which are the first.
  ContactAccelerations(Particles& particles, const Constraints& constraints, int count);

  struct Evaluation {
    double difference_step = 0;  // s, for differences; < 0: backwards
    bool has_friction = true;    // there is friction
  };
  // a: in, free accelerations at this state; out, those under the constraints, with J a = -bias,
  // and under resting contacts, with gap'' >= 0 and forces that never pull. values: the constraint
  // rows there. False if there is no solution.
  bool accelerate(const ParticleView& now, const RowValues& values,
                  std::span<const RestingContact> resting, const Evaluation& look,
                  const Constraints::Axes& a);
  // The contact forces of the last call, N, one for each resting contact, in their order.
  std::span<const ContactForce> contacts() const { return contacts_; }
  // The acceleration, m/s^2, by which it is pressed on, or < 0: with which it separates.
  double surplus(std::size_t k) const;
  std::span<const double> multipliers() const { return solver_.multipliers(); }  // N, of each row

  // a := free accelerations at a state, and those of kinematic particles.
  void free(const ParticleView& now, const Constraints::Axes& a) const;

  // The multipliers, N, of the rows at a state, for observers; without contacts if the solution
  // with them fails.
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
