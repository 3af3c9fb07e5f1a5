// Joints between bodies, and other constraints, as the contact solver sees them.
#pragma once

#include <span>
#include <vector>

#include "body_collision.h"
#include "contact_solver.h"
#include "core/base/array.h"
#include "core/particles/constraints/constraint_system.h"

namespace sim {

// Contact impulses act on bodies and particles as if they were free; project() takes all velocities
// to the nearest ones that the joints allow, in the metric of the masses, by constraint impulses.
// It is an orthogonal projection P, so that contact sees the matrix N P W N^T, which is symmetric.
class BodyJoints final : public JointProjection {
 public:
  BodyJoints(Particles& particles, ConstraintSystem& constraint_system);

  // Begins at the end of a free step; solver bodies: those of the bodies, then those of `entered`.
  void begin(const BodyCollision& body_collision, std::span<const int> entered, double t_end,
             const double* x_next);
  void project(std::span<SolverBody> solver_bodies, bool change_alone) override;
  // From now on solver bodies hold displacements instead of velocities, from zero.
  void begin_moves();
  void end_moves();  // other particles go with them
  // Stores positions and velocities of particles without a solver body, then projects all onto the
  // constraints. False, with a refusal of the constraints, if there is no such state.
  bool store(double* x_next);
  const std::string& refusal() const { return constraint_system_->refusal(); }

 private:
  Particles* particles_;
  ConstraintSystem* constraint_system_;
  const BodyCollision* body_collision_ = nullptr;
  std::span<const int> entered_;
  double t_end_ = 0;
  bool moves_ = false;
  Array end_, change_, moved_;       // states: as now; of changes, of moves
  std::vector<Vec3> arms_;           // of the particles of bodies, from their centers
  std::vector<Mat3> inertia_;        // inverse, of bodies
  std::vector<Vec3> shift_;          // of other particles, m
  std::vector<std::uint8_t> other_;  // which these are
};

}  // namespace sim
