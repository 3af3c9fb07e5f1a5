// The contact solver: impulses that prevent penetration, with Coulomb friction.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "approach.h"
#include "core/base/thread_pool.h"
#include "core/math/mat3.h"
#include "core/particles/contact_law.h"

namespace sim {

class BodyJoints;

// A body in the contact solver: a rigid body or a particle at the end of a step. Infinite mass:
// inverse_mass 0.
struct SolverBody {
  double inverse_mass = 0;          // 1/kg
  Mat3 inverse_inertia;             // in space, 1/(kg m^2)
  Vec3 velocity, angular_velocity;  // m/s, rad/s
  Vec3 translation, rotation;       // m, rad: the motion by the impulses so far
  Vec3 center;                      // m, at the end of the step without contact
  double gained = 0;                // m/s, by forces within the step
};

// A contact point of two solver bodies; second = -1: a collider, which no impulse moves.
struct ContactPoint {
  int first = 0, second = -1;
  std::int64_t feature = 0;
  int key1 = 0, key2 = 0;   // the keys of both sides, the same from step to step
  Vec3 normal, arm1, arm2;  // to the first; from the centers of mass, m
  Vec3 ground;              // velocity of the fixed side, m/s
  double gap = 0;           // m, at the end of the free step
  double tiny = 0;          // m: a gap that is none
  double rounding = -1;     // m, see ManifoldPoint
  // The motion in which impacts are sought: the free motion, but without forces if there is contact
  // from the start, since the contact balances them.
  double path_gap = 0, path_gain = 0;  // m, at the end; m/s, not counted in the rate there
  double acceleration = 0;             // m/s^2
  // The same along the surface.
  Vec3 path_slip_gain, slip_acceleration;
  double friction = 0, restitution = 0;  // of rest, at the slip at hand; of a slow blow
  ContactMaterial sides[2];              // if one has a law other than Coulomb's
  double before = 0;    // m/s, the normal velocity just before they touch; < 0: nearing
  double after = 0;     // s, from the touch to the end of the step
  double duration = 0;  // s: an impulse p moves the gap by lever * p / mass
  bool active = false;
  Vec3 u, v;  // directions along the surface
  double inverse_mass_n = 0,
         inverse_mass_t = 0;  // 1/kg, along the normal and, at most, along the surface
  double normal_impulse = 0, tangent_impulse[2] = {};  // N s, of resting contact
  Vec3 friction_impulse;                               // N s, the last two in space, to begin with
  double first_impulse = 0;                            // N s, along the normal: the warm start
  double first_rate = 0;                               // m/s, the normal velocity that it leaves
  double given = 0;                                    // m/s, gained by forces after the touch
  double offset = 0;  // resting contact is 0 <= normal velocity + offset
  int collider = -1;  // the fixed side

  bool has_law() const { return sides[0].law || sides[1].law; }
  // The combined laws of both sides: the larger restitution, the geometric mean of friction; speeds
  // in m/s.
  double restitution_at(double approach) const;
  double friction_at(double slip) const;
};

class ContactSolver {
 public:
  // The motion of its gap, as the impulses so far have it.
  static Approach approach_of(std::span<const SolverBody> solver_bodies, const ContactPoint& m);

  // The joints that all following impulses respect; null: none.
  void set_joints(BodyJoints* joints) { joints_ = joints; }

  // Sets the tangents of contacts, and their friction along these.
  static void prepare(std::span<ContactPoint> contacts, ThreadPool& pool);

  // Resolves the impacts in a step of length h in order of their time of impact, including those
  // caused by earlier impulses, each by the laws of its sides. Simultaneous impacts are solved pair
  // by pair in their order, repeatedly, until none approaches. So an impulse runs along a row of
  // balls, as in Newton's cradle, whatever is between them. A flight shorter than `shortest`, s, is
  // rest. The work is bounded: approaches left among hundreds of points are resolved without
  // restitution, as resting contacts.
  void solve_restitution(std::span<SolverBody> solver_bodies, std::span<ContactPoint> contacts,
                         double h, double shortest, ThreadPool& pool);

  // The change of the gap at the end of the step by impulses, m.
  static double moved(std::span<const SolverBody> solver_bodies, const ContactPoint& contact);

  // Takes the arms at that time, s, before the end, on the ways that impulses so far have led to;
  // both from the point in the middle, so that impulses then conserve angular momentum.
  static void set_arms(std::span<const SolverBody> bodies, ContactPoint& contact, double time);

  // Applies the present impulses of resting contacts, the warm start of RestingSolver, and what
  // joints make of them.
  void start(std::span<SolverBody> solver_bodies, std::span<const ContactPoint> contacts);

  // Applies an impulse p to the first and -p to the second, and the displacement that it causes.
  static void apply(std::span<SolverBody> solver_bodies, const ContactPoint& contact, const Vec3& p,
                    double duration);
  static Vec3 velocity(std::span<const SolverBody> solver_bodies,
                       const ContactPoint& contact);  // of the first, relative

 private:
  static void find_inverse_masses(std::span<const SolverBody> solver_bodies, ContactPoint& m);
  double joint_inverse_mass(std::span<const SolverBody> solver_bodies, const ContactPoint& m);
  std::array<int, 2> groups_of(const ContactPoint& m) const;
  void list_contacts(std::size_t bodies, std::span<const ContactPoint> contacts);
  void update_approach(std::span<const SolverBody> solver_bodies,
                       std::span<const ContactPoint> contacts, std::size_t k, double now);

  BodyJoints* joints_ = nullptr;
  std::vector<SolverBody> scratch_;               // changes of velocities
  std::vector<std::uint8_t> touched_;             // groups of joints
  std::vector<Approach> approaches_;              // of each contact
  std::vector<double> touches_;                   // their next, see next_touch()
  std::vector<std::size_t> first_, contacts_of_;  // of each body, one list behind the other
};

}  // namespace sim
