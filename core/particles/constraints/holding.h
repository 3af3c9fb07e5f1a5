// What keeps the particles of a system to their constraints.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/particles/constraints/constraint_solver.h"
#include "core/particles/constraints/holding_force.h"

namespace sim {

class Particles;

// States are those of the particles, behind which lie the numbers of the constraints.
class Holding {
 public:
  explicit Holding(Particles& particles);
  ~Holding();

  // One by one, and then, and whenever the masses or pins are others, begin().
  void add(std::unique_ptr<Constraint> constraint, const std::string& name,
           const std::string& place, double feedback, const double* initial);
  void begin();

  const Constraints& constraints() const noexcept { return constraints_; }
  // Where their numbers lie in a state, and how many these are.
  std::size_t memory_begin() const noexcept;
  std::size_t memory_size() const noexcept { return constraints_.memory_size(); }

  // The initial state, put where it has to be. Throws Error{kScene} where there is none near.
  void start(double* state);

  // a += what the constraints make of it; `memory` theirs. False where that is not finite.
  bool constrain(const ParticleView& view, const double* memory, double* const a[3]);
  // Puts a state among those allowed; near: it is the end of a step whose last evaluation was near.
  bool settle(double t, double* state, bool near);

  // The two halves of that, of positions and of velocities; numbers of constraints stay.
  bool place(double t, double* state, bool near);
  bool still(double t, double* state);

  // For others who solve beside the constraints: at this state v := the nearest velocities that are
  // allowed; without their drive: changes of velocities.
  bool begin_projections(double t, double* state);
  void project(const Constraints::Axes& v, bool with_drive);

  // Why the last step found no allowed state; empty where it did.
  const std::string& refusal() const noexcept { return refusal_; }
  void refuse(std::string why) { refusal_ = std::move(why); }

  // Of the first so many particles, of which constraints join some, each touches colliders.
  void join_contact(int count) { touching_count_ = count; }
  int touching_count() const { return touching_count_; }
  bool joins_contact() const;

  // Of any state; they leave nothing behind.
  std::vector<HoldingForce> forces(double t, const double* state);
  double driving_power(double t, const double* state);  // of constraints that move, W
  ConstraintDrift drift(double t, const double* state) const;

  const std::vector<std::string>& notes() const { return notes_; }

 private:
  bool observe(const ParticleView& now, const double* state);

  Particles* particles_;
  Constraints constraints_;
  std::unique_ptr<ConstraintSolver> solver_, observer_;  // observer: between steps
  std::unique_ptr<class TouchingForces> touching_;       // where particles touch something
  int touching_count_ = 0;
  std::string refusal_;
  std::vector<std::string> notes_;
};

}  // namespace sim
