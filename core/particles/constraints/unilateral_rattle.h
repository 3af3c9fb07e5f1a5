// The forces of surfaces and constraints together in one substep: RATTLE with inequalities.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/base/array.h"
#include "core/particles/constraints/active_set_contact_solver.h"
#include "core/particles/constraints/constraint_system.h"
#include "core/particles/particles.h"
#include "core/particles/step_path.h"

namespace sim {

// A substep of length r, whose end without contact is known. Resting contacts act through all of
// it, as the forces of rods do in RATTLE (Andersen (1983); Moreau (1988); Kaufman & Pai (2012)):
//   q := q + r^2/2 W (J0^T mu + push), v := v + r/2 W (the same), with phi = 0, gap >= 0 at the end
//   v := v + W (J1^T nu + push),                                 with J1 v = 0, gap' >= 0
// Impacts at its end, or contacts at r = 0, obey Newton's law of restitution and Coulomb's law of
// friction, with all rows and all contacts solved together.
class UnilateralRattle {
 public:
  static constexpr double kNoImpact = 2;         // beyond the substep
  static constexpr double kSimultaneous = 1e-6;  // share of a substep: impacts count as one

  // first_order: of a method of first order, whose velocities belong to another time: late_work().
  UnilateralRattle(Particles& particles, ConstraintSystem& constraint_system,
                   bool first_order = false);

  struct Impact {
    int particle = 0;
    Collider* collider = nullptr;
    double s = 0;                          // time of impact, as a share of the substep
    Vec3 normal;                           // there
    double closing = 0, gained = 0;        // m/s: approach velocity; its change in the substep
    double gap = 0;                        // m, at the end
    double pressed = 0;                    // N s, the normal impulse of resting contact
    bool known = false;                    // it lay there at the start
    bool bounces = false, leaves = false;  // if the substep ends at it; if it goes on
    bool through = false, cuts = false;
  };
  struct SubstepStates {
    double t, r;  // from t on
    const double *from, *to;
  };
  struct Substep {
    double t, r;
    const double* from;
    double* to;
    bool last = false;  // there is no smaller one
    SubstepStates ends() const { return {t, r, from, to}; }
  };

  void find_impacts(const SubstepStates& ends);  // impacts() := those in the substep
  std::vector<Impact>& impacts() { return impacts_; }
  double next_cut() const;  // the first impact, if there are not too many; 2: none
  // Resolves the impacts up to s; those that are not known as resting contacts count as hits.
  bool solve_substep(const Substep& substep, double until, bool hit);
  // Moves particles that penetrate a collider at x, put there by a user or by rounding, out without
  // velocity, and places those in contact onto their surfaces; `to` is that state. False if there
  // was nothing to correct.
  bool push_out(double t, const double* x, double* to);
  // Corrects the constraint drift that the integrator left at the end of a substep. resting: the
  // resting contacts; active ones are put back onto their surfaces, from either side, and those
  // that stick (extra_friction) stop.
  bool correct_drift(const Substep& substep, std::span<const ContactForce> resting);
  // impacts() := the contacts at x; those closing faster than slow + `still` of their velocity are
  // hits; true if there are any.
  bool find_hits(double t, const double* x, double still, double slow);
  std::span<const int> near(
      const SubstepStates& ends) {  // particles that may touch something in the substep
    find_candidates(ends);
    return candidates_;
  }
  void record_work();  // the work of the last of these, and whom it touched

 private:
  bool find_impact(const SubstepStates& ends, int i, Collider& collider, Impact& impact) const;
  void begin_contact_force(const Impact& impact, bool hit);
  double friction_of(const ContactForce& contact, const Substep& substep) const;
  void predict_friction(const Substep& substep);
  bool solve_positions(const Substep& substep);
  bool project_contacts(const Substep& substep, bool nearest);
  bool add_penetrating(const Substep& substep);
  bool solve_end_velocities(const Substep& substep);
  bool solve_velocities(const Substep& substep, double enough);
  double max_speed(const Substep& substep) const;  // m/s, of surfaces too
  bool refuse(const std::string& unit);
  double energy(double t, const double* state) const;
  double late_work_of(const Substep& substep) const;  // J, of the last solve
  void find_candidates(const SubstepStates& ends);    // into candidates_

  Particles* particles_;
  ConstraintSystem* constraint_system_;
  bool first_order_;
  int most_moments_;
  RowValues start_rows_, rows_;
  ActiveSetContactSolver solver_;
  std::vector<int> candidates_;  // free particles that may touch something
  std::vector<Impact> impacts_;
  std::vector<ContactForce> contacts_, velocity_contacts_;  // for places, for velocities
  Array free_;                                              // end of the substep without contact
  ContactWork work_;                                        // of the last solve
  double until_ = 0;  // end of the last solve, as a share: later impacts are not part of it
};

}  // namespace sim
