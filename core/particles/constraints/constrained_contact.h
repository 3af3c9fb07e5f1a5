// Contact of constrained particles: impulses are transmitted through the rods.
#pragma once

#include <memory>
#include <utility>

#include "core/base/array.h"
#include "core/ode/ode_system.h"
#include "core/particles/constraints/unilateral_rattle.h"

namespace sim {

// Steps of a stepper that keeps to the constraints, with particles that touch colliders. Impacts
// act at their time of impact: the step is cut there. Resting contacts act through each substep. So
// contact is of second order. If more than a few particles hit in one step, or so gently that they
// stay, they are treated as resting contacts without a cut. A pure function of a step, the same on
// any number of threads.
class ConstrainedContact {
 public:
  // first_order: the stepper is of first order, see UnilateralRattle.
  ConstrainedContact(Particles& particles, ConstraintSystem& constraint_system, bool first_order);

  // See Stepper::step. False, with a refusal of the constraint system, if no state is allowed.
  bool step(Stepper& stepper, double t, double h, const double* x, double* x_next);

 private:
  using Substep = UnilateralRattle::Substep;
  using Impact = UnilateralRattle::Impact;

  bool advance(Stepper& stepper, const Substep& substep, bool again);
  double make(Stepper& stepper, const Substep& substep, bool again, bool may_cut);

  Particles* particles_;
  ConstraintSystem* constraint_system_;
  UnilateralRattle rattle_;
  Array start_;           // the state at the start of a substep
  bool touched_ = false;  // something, in this step
};

// A stepper that resolves contact in this way.
class ConstrainedContactStepper final : public Stepper {
 public:
  ConstrainedContactStepper(Particles& particles, ConstraintSystem& constraint_system,
                            std::unique_ptr<Stepper> stepper, bool first_order)
      : contact_(particles, constraint_system, first_order), stepper_(std::move(stepper)) {}

  bool step(double t, double h, int /*count*/, const double* x, double* x_next) override {
    return contact_.step(*stepper_, t, h, x, x_next);
  }
  void restart() override { stepper_->restart(); }
  bool midpoint_kicks() const override { return stepper_->midpoint_kicks(); }

 private:
  ConstrainedContact contact_;
  std::unique_ptr<Stepper> stepper_;
};

}  // namespace sim
