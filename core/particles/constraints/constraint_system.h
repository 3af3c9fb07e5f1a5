// The constraints of a particle system, and the solvers that enforce them.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/array.h"
#include "core/particles/constraints/constraint_force.h"
#include "core/particles/constraints/constraints.h"

namespace sim {

class ConstraintSolver;
class Particles;

// A state is that of the particles, followed by the internal variables of the constraints.
class ConstraintSystem {
 public:
  explicit ConstraintSystem(Particles& particles);
  ~ConstraintSystem();

  // Adds one constraint; begin() follows the last one, and each change of masses or pins.
  void add(std::unique_ptr<Constraint> constraint, const std::string& name,
           const std::string& place, double feedback, const double* initial);
  void begin();
  void refresh();  // when ties of constraints are broken or mended

  const Constraints& constraints() const noexcept { return constraints_; }
  // The offset of the internal variables of the constraints in a state, and their number.
  std::size_t internal_begin() const noexcept;
  std::size_t internal_size() const noexcept { return constraints_.internal_size(); }

  // The initial state, projected onto the constraints. Throws Error{kScene} if no feasible state is
  // near.
  void start(double* state);

  // a += W times the constraint forces; `memory`: their internal variables. False if that is not
  // finite.
  bool add_constraint_forces(const ParticleView& view, const double* memory, double* const a[3]);
  // Projects a state onto the constraints; near: at the end of a step whose last evaluation was
  // near.
  bool project_state(double t, double* state, bool near);

  // The two halves of project_state(), positions and velocities; internal variables stay.
  bool project_positions(double t, double* state, bool near);
  bool project_velocities(double t, double* state);

  // The reason why the last step found no allowed state; empty if it found one.
  const std::string& refusal() const noexcept { return refusal_; }
  void refuse(std::string why) { refusal_ = std::move(why); }

  // The number of drifts beyond the limit of SHAKE, since the start.
  void count_implicit_drift() { ++implicit_drifts_; }
  std::int64_t implicit_drifts() const { return implicit_drifts_; }

  // The first `count` particles touch colliders; constraints join some of them.
  void join_contact(int count) { contact_count_ = count; }
  int contact_count() const { return contact_count_; }
  bool joins_contact() const;

  // These evaluate any state and store nothing of it.
  std::span<const double> multipliers(double t, const double* state);  // N; empty: not finite
  std::vector<ConstraintForce> forces(double t, const double* state);
  double driving_power(double t, const double* state);  // of constraints that move, W
  ConstraintDrift drift(double t, const double* state) const;

  const std::vector<std::string>& notes() const { return notes_; }

 private:
  bool observe(const ParticleView& now, const double* state);

  Particles* particles_;
  Constraints constraints_;
  std::unique_ptr<ConstraintSolver> solver_, observer_;  // observer: between steps
  std::unique_ptr<class ContactAccelerations>
      contact_accelerations_;  // null unless particles touch colliders
  Array sums_;                 // of the observer
  int contact_count_ = 0;
  std::int64_t implicit_drifts_ = 0;
  std::string refusal_;
  std::vector<std::string> notes_;
};

}  // namespace sim
