// Splitting methods on particles, one part after the other, for systems with internal variables,
// constraints or prescribed motion.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/base/array.h"
#include "core/ode/ode_system.h"
#include "core/particles/constraints/constraint_solver.h"
#include "core/particles/constraints/constraint_system.h"
#include "core/particles/explicit/contact_pass.h"
#include "core/particles/explicit/internal_drift.h"
#include "core/particles/particles.h"

namespace sim {

// The internal variables m of forces belong to the drifts, with q and t: a kick keeps q, m and t.
//   drift by tau:  q := q + tau v,  m along m' = g(t, m) by the classical Runge-Kutta method
// so that methods up to the fourth order keep it. A method of one drift between two kicks (verlet)
// resolves particle contact after both, any other method at its end. With constraints, velocities
// are projected before each drift and after the last kick: RATTLE (Andersen (1983), J. Comput.
// Phys. 52, 24-34), with the gains of damped particles for masses.
class GenericSplittingStepper final : public Stepper {
 public:
  // constraint_system: null without constraints.
  GenericSplittingStepper(Particles& particles, const SplitPlan& plan,
                          ConstraintSystem* constraint_system = nullptr);

  bool step(double t, double h, int count, const double* x, double* x_next) override;
  void restart() override { known_ = held_ = false; }
  bool midpoint_kicks() const override { return particles_->needs_velocities(); }

 private:
  void set_step_size(double h);
  void lead(double t, double tau, double* state);
  void drift(double t, double tau, double* state);
  bool constrained_drift(std::size_t i, double t, double d, double* state);  // after kick i
  // kinematic_t: the time at which kinematic velocities belong to the middle of the kick.
  void kick(std::size_t i, double t, double kinematic_t, double* state);
  void resolve(double t, double h, std::size_t i, const double* x, double* x_next);
  bool refuse(const double* x, double* x_next) const;
  void add_constraint_forces(const ParticleView& view, const double* memory);
  void change(std::size_t slot, const std::array<double*, 3>& v, const std::array<double*, 3>& to);

  Particles* particles_;
  ConstraintSystem* constraint_system_;
  SplitPlan plan_;
  Layout half_, one_;
  std::optional<ParticleContactPass> contact_pass_;
  bool contact_inside_;
  bool closes_;         // the last acceleration of a step is the first of the next
  bool known_ = false;  // ... and is in a_
  double h_ = 0;
  Array a_, v_half_;                  // accelerations; velocities in the middle of a kick
  std::vector<Array> keeps_, gains_;  // of each kick and its first half, of every particle
  InternalDrift internal_drift_;
  std::optional<ConstraintSolver> solver_;    // if there are constraints
  Array kicked_;                              // velocities before a drift of theirs
  std::vector<std::vector<double>> weights_;  // of each kick: gain / (tau m), 1/kg
  bool held_ = false;                         // the last factors are those of the first drift
};

}  // namespace sim
