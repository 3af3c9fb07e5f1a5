// Contact of rigid bodies with colliders, each other and particles, between steps of any method.
#pragma once

#include <optional>
#include <utility>

#include "body_collision.h"
#include "body_joints.h"
#include "contact_solver.h"
#include "core/particles/explicit/contact_pass.h"
#include "core/particles/step_correction.h"
#include "landing_solver.h"
#include "resting_solver.h"
#include "sweep_and_prune.h"

namespace sim {

// A method makes a step from x to x_next without contact; resolve() then adds the contact impulses.
// Impacts act at their time of impact, where the gap closes inside the step, by Newton's law of
// restitution; resting contacts act as constant forces through the step. So a stack at rest keeps
// its velocities and positions to rounding, and impacts and sliding are of second order in uniform
// gravity. Where both meet in one step, the moves along normals are found anew. Penetration left by
// the solver is removed by position correction, without changing velocities. Resting impulses are
// warm-started from those of the step before: memory(). The friction of two surfaces is their
// geometric mean, the restitution the larger one; a particle takes those of the surface that it
// touches.
class RigidContact {
 public:
  static constexpr double kToRounding = 1e-12;
  static constexpr double kMargin = 1e-3;  // of a radius: points are sought at least so far

  // tolerance: of the residual, relative to the largest velocity, and of the overlap of bodies,
  // relative to a radius. constraint_system: null: none, and single particles are resolved here.
  RigidContact(BodyCollision body_collision, Particles& particles,
               ConstraintSystem* constraint_system, double tolerance);

  using Step = StepCorrection::Step;
  StepCorrection::Outcome resolve(const Step& step);
  // The reason why the last step has no solution; empty if it has one.
  const std::string& refusal() const { return refusal_; }

  const BodyCollision& body_collision() const { return body_collision_; }
  // The impulses of the last step, which warm-start the next.
  std::vector<double> memory() const;
  void recall(std::span<const double> memory);
  void forget() { warm_start_.clear(); }

  double take_work();  // J, that contact took since the last call
  struct Counts {
    int most = 0;            // points that touched at once
    double fastest = 0;      // m/s, of bodies in contact
    double unconverged = 0;  // m/s, the last change of the solver where it did not get to its end
    int halved = 0;          // steps, that were too long
  };
  const Counts& counts() const { return counts_; }

 private:
  struct WarmStart {
    int first, second;  // keys of movers; second: of a collider -1 - its number
    std::int64_t feature;
    Vec3 friction_impulse;  // N s
    double normal_impulse;
  };
  struct Reach {  // of one mover in one step
    RigidState before, after;
    double radius = 0, path_length = 0;  // m, around the center of mass; the longest of any point
    double scale = 0, pushed = 0;        // m, of small gaps; how much further contact is sought
    double duration = 0;  // s: a force through the step moves it by lever * its velocity
    double gained = 0;    // (m/s)^2: the velocity change by forces and constraints
    bool fixed = false, fast = false;  // one of its particles is pinned; it is seen on its way
  };
  struct Found {
    std::vector<ContactPoint> contacts;
    std::vector<ManifoldPoint> points;  // of one pair
    std::size_t kept = 0;               // its first in warm_start_
  };
  int key(int solver_body) const;  // of a body its number, of a particle its id behind those
  void load(const Step& step);
  int enter(int particle, int body, const Step& step);
  void find(const Step& step);
  void find_pairs();
  void find_particle_pairs(const Step& step);
  void find_of(int body, const Step& step, Found& found);
  void touch_particle(int body, int particle, const Step& step, Found& found);
  template <class Collide>
  void add_manifold(int first, int second, int collider, double margin, const Step& step,
                    Found& found, const Collide& collide);
  void add_contact(const ManifoldPoint& point, int first, int second, int collider,
                   const Step& step, double left, Found& found) const;
  void move_arms(std::span<ContactPoint> of_pair) const;
  void apply_warm_start(ContactPoint& contact, std::size_t& kept) const;
  void find_further(const Step& step);
  bool bounces(const ContactPoint& contact) const;
  std::pair<double, double> gap_and_rate(const ContactPoint& contact) const;
  bool activate(double h, double& scale);
  bool hold_open(double h, double scale), bound_moves(double h), stay_apart() const;
  double solve(const Step& step);
  void copy_moves(), take_moves(), fit_moves(bool bounded);
  void solve_moves(std::span<ContactPoint> contacts, double tolerance, bool further);
  bool pass_through(const Step& step);
  void separate(double t);
  void store(double* x_next);
  void store_warm_start();

  BodyCollision body_collision_;
  Particles* particles_;
  std::optional<ParticleContactPass> contact_pass_;  // of single particles and colliders
  ContactSolver contact_solver_;
  LandingSolver landing_solver_;
  RestingSolver resting_solver_;
  double tolerance_, gap_tolerance_, shortest_ = 0;  // the last: s, of the flights of this step
  std::unique_ptr<BodyJoints> joints_;  // if there are others than bodies have by themselves
  std::vector<int> entered_;            // particles that are movers in this step, behind the bodies
  std::vector<int> solver_body_of_;     // of each single particle, -1: none
  double fastest_single_ = 0;           // m/s
  std::vector<Reach> reach_;            // of movers
  std::vector<SolverBody> solver_bodies_, moved_bodies_;
  std::vector<Ball> balls_;  // around bodies and their possible paths
  SweepAndPrune broad_phase_;
  std::vector<int> loose_;                           // single particles that bodies may touch
  std::vector<std::pair<int, int>> particle_pairs_;  // of bodies, ascending
  std::vector<Found> found_;                         // of each thread
  std::vector<ContactPoint> contacts_, known_, overlaps_;
  std::vector<WarmStart> warm_start_;
  std::string refusal_;
  double work_ = 0;  // J
  Counts counts_;
};

}  // namespace sim
