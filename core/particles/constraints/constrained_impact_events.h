// Contact of constrained particles as events.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/particles/constraints/contact_accelerations.h"
#include "core/particles/constraints/unilateral_rattle.h"
#include "core/particles/impact_events.h"

namespace sim {

// The forces of resting contacts are part of f, solved together with the rows of the constraints
// for accelerations. Impacts are one problem of impulses. Friction is part of f, too, and every
// impact ends a step; or, for methods whose equations have to stay smooth, friction acts in two
// halves (UnilateralRattle), and a step is cut where few particles hit, otherwise they are treated
// as resting contacts: contact is then of second order.
class ConstrainedImpactEvents final : public ImpactEvents {
 public:
  ConstrainedImpactEvents(Particles& particles, ConstraintSystem& constraint_system);

  void set_smooth(bool smooth) { smooth_ = smooth; }
  void restart();  // masses or pins are others

  void begin(double t, double h, const double* x) override;
  double first(double t, double h, const double* x, const double* x_next) override;
  Outcome end(double t, double h, const double* x, double* x_next, bool cut) override;

  // True if there are resting contacts in the present step, to which t belongs.
  bool has_contact_forces_at(double t) const { return within(t) && !resting_.empty(); }
  // See ConstraintSystem::add_constraint_forces.
  bool add_constraint_forces(const ParticleView& view, const double* memory, double* const a[3]);

 private:
  void find_resting(const double* x);
  // Evaluates accelerations_ at a state, and the contact forces; false if there is no solution.
  bool evaluate(double t, const double* x);
  ContactAccelerations::Evaluation look_at(double t) const;
  bool lies(int i, const Collider* collider) const;
  double edge_of(const RestingContact& contact, double h, const ParticleView& before,
                 const ParticleView& after) const;
  void leave_edges(const UnilateralRattle::Substep& substep);
  void add_power(std::span<RestingContact> resting, double t, const double* x) const;
  bool correct_drift(const UnilateralRattle::Substep& substep);
  bool solve_substep(const UnilateralRattle::Substep& substep, bool& had_impact);
  void find_others(const UnilateralRattle::SubstepStates& ends);
  bool at_end(double gap, const Vec3& place) const;

  ConstraintSystem* constraint_system_;
  ContactAccelerations forces_;
  UnilateralRattle rattle_;
  RowValues values_;
  bool smooth_ = false;
  std::vector<RestingContact> resting_;  // in the order of their particles
  std::vector<ContactForce> contacts_;
  std::vector<double> pressed_;  // N, of each, at the start
  Array accelerations_;
};

}  // namespace sim
