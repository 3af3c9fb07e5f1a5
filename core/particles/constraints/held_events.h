// Touches of particles that constraints join, as events.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/particles/constraints/held_press.h"
#include "core/particles/constraints/touching_forces.h"
#include "core/particles/touch_events.h"

namespace sim {

// What lies on surfaces is pushed in f, together with the rows of the constraints: one solve of
// accelerations. What hits bounces as one problem of impulses. Friction is part of f, too, and
// every touch ends a step; or, for methods whose equations are to stay smooth, friction acts by its
// two halves (HeldPress), and a step is cut where few hit, else they are pressed on through it:
// contact is of order 2 then.
class HeldEvents final : public TouchEvents {
 public:
  HeldEvents(Particles& particles, Holding& holding);

  void set_smooth(bool smooth) { smooth_ = smooth; }
  void begin_anew();  // masses or pins are others

  void begin(double t, double h, const double* x) override;
  double first(double t, double h, const double* x, const double* x_next) override;
  Outcome end(double t, double h, const double* x, double* x_next, bool cut) override;

  // True where something lies on a surface in the present step, to which t belongs.
  bool pushes_at(double t) const { return within(t) && !lying_.empty(); }
  // As Holding::constrain, then.
  bool constrain(const ParticleView& view, const double* memory, double* const a[3]);

 private:
  void find_lying(const double* x);
  // accelerations_ at a state, and of each that lies what it does; false where there are none.
  bool evaluate(double t, const double* x);
  TouchingForces::Look look_at(double t) const;
  bool lies(int i, const Collider* collider) const;
  void add_power(std::span<LyingOn> lying, double t, const double* x) const;
  bool put_back(const HeldPress::Piece& piece);
  bool press(const HeldPress::Piece& piece, bool& jumped);
  void find_others(const HeldPress::Ends& ends);
  bool at_end(double gap, const Vec3& place) const;

  Holding* holding_;
  TouchingForces forces_;
  HeldPress press_;
  RowValues values_;
  bool smooth_ = false;
  std::vector<LyingOn> lying_;  // in the order of their particles
  std::vector<Push> pushes_;
  std::vector<double> pressed_;  // N, of each, at the start
  Array accelerations_;
};

}  // namespace sim
