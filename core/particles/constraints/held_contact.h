// Contact of single particles where constraints join them: impulses run through the rods.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/array.h"
#include "core/ode/ode_system.h"
#include "core/particles/constraints/holding.h"
#include "core/particles/constraints/pushes.h"
#include "core/particles/particles.h"
#include "core/particles/way.h"

namespace sim {

// Steps of a stepper that keeps to the constraints, and in which particles touch colliders. What
// hits, hits at its moment: the step is cut there, and bounces by Newton's law and Coulomb's, all
// rows and all that touches taken together. What lies on a surface is pressed on through each piece
// of r, as RATTLE holds rods (Andersen (1983); Moreau (1988); Kaufman & Pai (2012)):
//   q := q + r^2/2 W (J0^T mu + push), v := v + r/2 W (the same), with phi = 0, gap >= 0 at the end
//   v := v + W (J1^T nu + push),                                 with J1 v = 0, gap' >= 0
// So contact is of order 2. Where more than a few hit in one step, or so gently that they stay,
// they are pressed on without a cut. A pure function of a step, the same on any number of threads.
class HeldContact {
 public:
  HeldContact(Particles& particles, Holding& holding);

  // As Stepper::step; False with a refusal of `holding` where no state is allowed.
  bool step(Stepper& stepper, double t, double h, const double* x, double* x_next);

 private:
  struct Meeting {
    int particle = 0;
    Collider* collider = nullptr;
    double s = 0;                    // where on the way it touches
    Vec3 normal;                     // there
    double closing = 0, gained = 0;  // m/s: how fast then; what it changes by in the piece
    bool known = false;              // it lay there at the start
    bool bounces = false, through = false, cuts = false;
  };
  struct Piece {
    double t, r;  // from t on
    const double* from;
    double* to;
    bool last = false;  // there is no smaller one
  };

  bool put_out(double t, const double* x);
  void enter();
  bool advance(Stepper& stepper, const Piece& piece, bool again);
  double make(Stepper& stepper, const Piece& piece, bool again, bool may_cut);
  void find(const Piece& piece);
  bool look(const Piece& piece, int i, Collider& collider, Meeting& meeting) const;
  double next_cut() const;  // of what was found; 2: none
  // Of the meetings up to s, those that are not known as hits.
  bool press(const Piece& piece, double until, bool hit);
  void begin_push(const Meeting& meeting, bool hit);
  void predict_friction(const Piece& piece);
  bool find_place(const Piece& piece);
  bool place(const Piece& piece, bool nearest);
  bool add_inside(const Piece& piece);
  bool find_velocity(const Piece& piece);
  bool solve_velocities(const Piece& piece, double enough);
  double fastest(const Piece& piece) const;  // m/s, of moving_ too
  bool refuse(const std::string& unit);
  double energy(double t, const double* state) const;
  void find_near(double t, double r, const double* from, const double* to);  // into near_

  Particles* particles_;
  Holding* holding_;
  RowValues start_rows_, rows_;
  PushSolver solver_;
  std::vector<int> near_;  // free particles whose ways may touch something
  std::vector<Meeting> meetings_;
  std::vector<Push> pushes_, moving_;  // for places, for velocities
  Array start_, free_;  // states: where a piece begins; where it ends without contact
  ContactWork work_;    // of the last press()
  double until_ = 0;  // where on the way the last press() ended: what meets later is no part of it
  bool touched_ = false;  // something, in this step
};

// A stepper that does so.
class HeldContactStepper final : public Stepper {
 public:
  HeldContactStepper(Particles& particles, Holding& holding, std::unique_ptr<Stepper> stepper)
      : contact_(particles, holding), stepper_(std::move(stepper)) {}

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
