// Contact forces on constrained particles, solved together with the multipliers of the constraints.
#pragma once

#include <algorithm>
#include <vector>

#include "core/linear/row_matrix.h"
#include "core/particles/collider.h"
#include "core/particles/constraints/constraints.h"

namespace sim {

inline constexpr double kContactTolerance =
    1e-9;  // relative to a position or to a velocity: zero to rounding
// The contact force between a particle and a surface that it touches, or may touch.
struct ContactForce {
  int particle = 0;
  Collider* collider = nullptr;
  Vec3 normal{0, 1, 0};            // along which it pushes
  Vec3 surface_velocity{0, 0, 0};  // of velocities: that of the surface, m/s
  double min_velocity = 0;         // for velocities: the required one along the normal, m/s
  double friction = 0;             // Coulomb's coefficient
  double extra_friction = 0;       // added to the friction limit, in the unit of force; may be < 0
  bool active = false, bilateral = false;  // now; even where it would have to pull
  int changes = 0;                         // from acting to not acting
  double gap = 0;                          // just now
  double force = 0;                        // result: along the normal, in kg times the unit of y
  Vec3 friction_force{0, 0, 0};            // and along the surface
  Vec3 friction_impulse{0, 0, 0};          // N s, by friction in the first half of a substep
  double pressed = 0;                      // N s, from resting contact in the rest of a substep

  double max_friction() const {
    return std::max(0.0, friction * std::max(0.0, force) + extra_friction);
  }
};

// Solves y := y + W (J^T mu + sum of contact forces) for the multipliers mu and the forces:
//   row(y) = 0,  0 <= force, 0 <= gap(y), one of them 0,
//   pull = -most_pull slip / |slip|, or less if the slip y - ground along the surface is 0
// A particle with an active contact moves along its surface only: the gradients projected onto it
// make the Schur complement of the multipliers, whose pattern stays that of the rows. The active
// set is found by the primal-dual active set method (Hintermueller, Ito & Kunisch (2002), SIAM J.
// Optim. 13, 865-888). Friction is viscous, pull = -k slip, with k from the last iterate (Chan &
// Mulet (1999), SIAM J. Numer. Anal. 36, 354-367), so that it adds no energy at any iterate.
class ActiveSetContactSolver {
 public:
  using Axes = Constraints::Axes;

  // The problem for y: residuals of rows and gaps of surfaces, evaluated repeatedly.
  struct Problem {
    virtual ~Problem() = default;
    virtual bool rows(std::span<double> rest) = 0;  // the residual; false: not finite
    virtual double gap(ContactForce& contact, const Vec3& y) = 0;  // along its normal
    double row_tolerance = 0, gap_tolerance = 0;                   // residuals taken as 0
    double enough = 0;                                             // accepted if iterations stall
    double slow = 1;                                               // a slip that is none
    bool nearest = false;  // gradient and normals are those of y now, and damped
  };

  explicit ActiveSetContactSolver(const Constraints& constraints);

  // contacts: grouped by particle. gradient: J. False if no such y was found; then y is the last
  // iterate, and worst() its largest violation.
  bool solve(std::span<ContactForce> contacts, std::span<const Vec3> gradient, const Axes& y,
             Problem& problem);
  // Continues from the last solve(), with changed contacts.
  bool go_on(std::span<ContactForce> contacts, std::span<const Vec3> gradient, const Axes& y,
             Problem& problem);

  struct Worst {
    double row = 0, gap = 0;
    int row_id = -1;
  };
  const Worst& worst() const { return worst_; }
  std::span<const double> multipliers() const { return mu_; }  // in kg times the unit of y
  Vec3 added(int i) const { return vector_of(added_, i); }     // to y of one particle

 private:
  struct Group {  // the pushes on one particle
    int particle = 0;
    std::size_t begin = 0, end = 0;
    int rank = 0;
    Vec3 basis[3];           // of the normals of active contacts
    std::size_t of[3] = {};  // and the push that each is of
    double viscosity = 0;    // k, kg
    double mobility = 1;     // 1 / (1 + k / m), along the surface
  };
  struct Moved {
    double largest_change = 0;  // of one particle
    bool changed = false;       // the active set
    bool has_friction = false;  // some have friction
  };

  Vec3 vector_of(const std::vector<double>& field, int i) const;
  void add_to(std::vector<double>& field, int i, const Vec3& by) const;
  void gather(std::span<ContactForce> contacts);
  void span_normals(Group& group, std::span<const ContactForce> contacts) const;
  void distribute_force(const Group& group, std::span<ContactForce> contacts,
                        const Vec3& force) const;
  Moved shift(std::span<ContactForce> contacts, const Axes& y, Problem& problem, bool late);
  void set_viscosity(Group& group, double most, double slip, double slow) const;
  void project(std::span<const Vec3> gradient, double shift);
  void take(std::span<const Vec3> gradient, const Axes& y);
  Vec3 along(const Group& group, const Vec3& v) const;

  const Constraints* constraints_;
  RowMatrix matrix_;
  std::vector<Group> groups_;
  std::vector<int> group_of_;                                  // of each particle, -1: none
  std::vector<Vec3> projected_;                                // gradients along the surfaces
  std::vector<double> rest_, mu_, base_, added_, row_forces_;  // two of rows, three of particles
  double largest_ = 0;                                         // of the forces
  Worst worst_;
};

}  // namespace sim
