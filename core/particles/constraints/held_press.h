// What surfaces and constraints together do in one piece of a step.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/base/array.h"
#include "core/particles/constraints/holding.h"
#include "core/particles/constraints/pushes.h"
#include "core/particles/particles.h"
#include "core/particles/way.h"

namespace sim {

// A piece of r, of which it is known where it would end without contact. What lies on a surface is
// pressed on through all of it as RATTLE holds rods (Andersen (1983); Moreau (1988); Kaufman & Pai
// (2012)):
//   q := q + r^2/2 W (J0^T mu + push), v := v + r/2 W (the same), with phi = 0, gap >= 0 at the end
//   v := v + W (J1^T nu + push),                                 with J1 v = 0, gap' >= 0
// What hits at its end, or is pressed on after r = 0, bounces by Newton's law and Coulomb's, all
// rows and all that touches taken together.
class HeldPress {
 public:
  static constexpr double kNever = 2;        // a place on the way that is none
  static constexpr double kTogether = 1e-6;  // of a piece: what hits at once

  // Of a method of first order, whose velocities belong to another moment: late_work().
  HeldPress(Particles& particles, Holding& holding, bool first_order = false);

  struct Meeting {
    int particle = 0;
    Collider* collider = nullptr;
    double s = 0;                    // where on the way it touches
    Vec3 normal;                     // there
    double closing = 0, gained = 0;  // m/s: how fast then; what it changes by in the piece
    double gap = 0;                  // m, at the end
    double pressed = 0;              // N s, by what presses it all along besides
    bool known = false;              // it lay there at the start
    bool bounces = false, through = false, cuts = false;
  };
  struct Ends {
    double t, r;  // from t on
    const double *from, *to;
  };
  struct Piece {
    double t, r;
    const double* from;
    double* to;
    bool last = false;  // there is no smaller one
    Ends ends() const { return {t, r, from, to}; }
  };

  void find(const Ends& ends);  // meetings() := what the way meets
  std::vector<Meeting>& meetings() { return meetings_; }
  double next_cut() const;  // of what was found: the first hit, if not too many; 2: none
  // Of the meetings up to s, those that are not known as hits.
  bool press(const Piece& piece, double until, bool hit);
  // What is inside at x, by hand or by roundings, is put out, without velocity, and what touches is
  // put onto its surfaces; `to` is that state. False where nothing was wrong.
  bool put_out(double t, const double* x, double* to);
  // The end of a piece, which is off its surfaces and rods by what a method is off. lying: what
  // lies on surfaces; those that act are put onto them, pulled too, and what may not slip (spare)
  // stops.
  bool put_back(const Piece& piece, std::span<const Push> lying);
  // meetings() := what touches at x, and as hits what closes faster than slow + `still` of its
  // velocity; true where some do.
  bool find_hits(double t, const double* x, double still, double slow);
  std::span<const int> near(const Ends& ends) {  // particles that may touch something on the way
    find_near(ends);
    return near_;
  }
  void enter();  // the work of the last of these, and whom it touched

 private:
  bool look(const Ends& ends, int i, Collider& collider, Meeting& meeting) const;
  void begin_push(const Meeting& meeting, bool hit);
  double friction_of(const Push& push, const Piece& piece) const;
  void predict_friction(const Piece& piece);
  bool find_place(const Piece& piece);
  bool place(const Piece& piece, bool nearest);
  bool add_inside(const Piece& piece);
  bool find_velocity(const Piece& piece);
  bool solve_velocities(const Piece& piece, double enough);
  double fastest(const Piece& piece) const;  // m/s, of moving_ too
  bool refuse(const std::string& unit);
  double energy(double t, const double* state) const;
  double late(const Piece& piece) const;  // J, of the last press
  void find_near(const Ends& ends);       // into near_

  Particles* particles_;
  Holding* holding_;
  bool first_order_;
  RowValues start_rows_, rows_;
  PushSolver solver_;
  std::vector<int> near_;  // free particles whose ways may touch something
  std::vector<Meeting> meetings_;
  std::vector<Push> pushes_, moving_;  // for places, for velocities
  Array free_;                         // where a piece ends without contact
  ContactWork work_;                   // of the last press()
  double until_ = 0;  // where on the way the last press() ended: what meets later is no part of it
};

}  // namespace sim
