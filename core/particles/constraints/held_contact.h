// Contact of single particles where constraints join them: impulses run through the rods.
#pragma once

#include <memory>
#include <utility>

#include "core/base/array.h"
#include "core/ode/ode_system.h"
#include "core/particles/constraints/held_press.h"

namespace sim {

// Steps of a stepper that keeps to the constraints, and in which particles touch colliders. What
// hits, hits at its moment: the step is cut there. What lies on a surface is pressed on through
// each piece. So contact is of order 2. Where more than a few hit in one step, or so gently that
// they stay, they are pressed on without a cut. A pure function of a step, the same on any number
// of threads.
class HeldContact {
 public:
  // Of a stepper of first order, see HeldPress.
  HeldContact(Particles& particles, Holding& holding, bool first_order);

  // As Stepper::step; False with a refusal of `holding` where no state is allowed.
  bool step(Stepper& stepper, double t, double h, const double* x, double* x_next);

 private:
  using Piece = HeldPress::Piece;
  using Meeting = HeldPress::Meeting;

  bool advance(Stepper& stepper, const Piece& piece, bool again);
  double make(Stepper& stepper, const Piece& piece, bool again, bool may_cut);

  Particles* particles_;
  Holding* holding_;
  HeldPress press_;
  Array start_;           // where a piece begins
  bool touched_ = false;  // something, in this step
};

// A stepper that does so.
class HeldContactStepper final : public Stepper {
 public:
  HeldContactStepper(Particles& particles, Holding& holding, std::unique_ptr<Stepper> stepper,
                     bool first_order)
      : contact_(particles, holding, first_order), stepper_(std::move(stepper)) {}

  bool step(double t, double h, int /*count*/, const double* x, double* x_next) override {
    return contact_.step(*stepper_, t, h, x, x_next);
  }
  void restart() override { stepper_->restart(); }
  bool midpoint_kicks() const override { return stepper_->midpoint_kicks(); }

 private:
  HeldContact contact_;
  std::unique_ptr<Stepper> stepper_;
};

}  // namespace sim
