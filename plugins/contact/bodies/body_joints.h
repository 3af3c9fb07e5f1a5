// Joints between bodies, and other constraints, as the contact solver sees them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "body_collision.h"
#include "contact_solver.h"
#include "core/base/array.h"
#include "core/particles/constraints/constraint_system.h"
#include "joint_group.h"

namespace sim {

// Contact impulses act on bodies and particles as if they were free; project() takes velocities to
// the nearest ones that the joints allow, in the metric of the masses, by constraint impulses. It
// is an orthogonal projection P, so that contact sees the matrix N P W N^T, which is symmetric.
// A group holds all that constraints join, and is projected by itself; pinned particles and fixed
// bodies join none.
class BodyJoints {
 public:
  BodyJoints(Particles& particles, ConstraintSystem& constraint_system);

  // Begins at the end of a free step; solver bodies: those of the bodies, then those of `entered`.
  void begin(const BodyCollision& body_collision, std::span<const SolverBody> solver_bodies,
             std::span<const int> entered, double t_end, const double* x_next);
  std::size_t groups() const { return groups_.size(); }
  std::span<const int> bodies_of(std::size_t group) const { return places_[group]; }  // solver ones
  // -1: none, as of fixed ones.
  int group_of(int body) const { return group_of_[static_cast<std::size_t>(body)]; }
  const JointGroup& group(std::size_t number) const { return groups_[number]; }
  // Projects what is asked for onto the nearest that the joints allow. Displacements are those of
  // the bodies by the impulses so far: impulses of the joints act for as long as those of contact.
  // Different groups may be projected on different threads.
  void project(std::span<SolverBody> solver_bodies, std::size_t group, JointGroup::What what);
  // From now on solver bodies hold displacements instead of velocities: those so far, or further
  // ones, from zero. Other particles go with them.
  void begin_moves(bool further);
  void end_moves();
  // Stores positions and velocities of particles without a solver body, then projects all onto the
  // constraints. False, with a refusal of the constraints, if there is no such state.
  bool store(double* x_next);
  const std::string& refusal() const { return constraint_system_->refusal(); }

 private:
  void find_groups();
  void prepare(std::span<const SolverBody> solver_bodies, std::size_t group);

  Particles* particles_;
  ConstraintSystem* constraint_system_;
  const BodyCollision* body_collision_ = nullptr;
  double t_end_ = 0;
  bool moves_ = false, finite_ = true;
  Array end_;         // the state
  RowValues values_;  // of the equations there
  std::vector<JointGroup> groups_;
  std::vector<std::vector<int>> places_;                     // of the solver bodies of each group
  std::vector<std::uint8_t> prepared_;                       // of each group: it is factorised
  std::vector<int> group_of_;                                // of each solver body, -1: none
  std::vector<int> group_of_particle_, member_of_particle_;  // of each that is in one, else -1
  std::vector<int> term_of_entry_;   // of each entry of the pattern, in its group; -1: fixed
  std::vector<int> body_of_;         // of each particle, -1: none
  std::vector<Vec3> arms_;           // of each particle, from the center of its body
  std::vector<std::uint8_t> fixed_;  // of each particle: it or its body is
  RowPattern pattern_;               // from which the groups were found
};

}  // namespace sim
