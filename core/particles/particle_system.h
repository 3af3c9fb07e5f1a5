// Particles as a system X' = f(t, X), with the stepper or solver for each plan.
#pragma once

#include <optional>

#include "core/ode/ode_system.h"
#include "core/particles/constraints/constraint_system.h"
#include "core/particles/implicit_solvers.h"
#include "core/particles/particles.h"

namespace sim {

class Reordering;
class ParticleImpactEvents;
class ConstrainedImpactEvents;

class ParticleSystem final : public OdeSystem, public Particles {
 public:
  ParticleSystem(const std::vector<double>& masses, const std::vector<int>& pinned,
                 std::vector<std::unique_ptr<Force>> forces, const double* initial,
                 ThreadPool& pool);
  ~ParticleSystem() override;

  // Explicit methods of fixed steps may reorder particles by position for large nets. Their
  // steppers are made after this.
  void order_by(const ParticleView& initial);

  std::size_t size() const noexcept override {
    return layout().size() + internal_size() +
           (constraint_system_ ? constraint_system_->internal_size() : 0);
  }
  StateShape shape() const override;

  // Creates the constraint system, to which constraints may then be added; null if there are none.
  ConstraintSystem& add_constraint_system();
  ConstraintSystem* constraint_system() const noexcept { return constraint_system_.get(); }
  void refresh_constraints();  // after ties of theirs broke; steppers have to be made again
  void set_masses(const std::vector<double>& masses, const std::vector<int>& pinned,
                  bool some_move = false);

  bool has_inequalities() const noexcept override {
    return !contacts().empty() || constraint_system_;
  }
  bool is_changed_between_steps() const noexcept override { return changed_between_steps_; }
  void set_changed_between_steps(bool changed) { changed_between_steps_ = changed; }
  bool project(double t, double* x) override;
  const double* begin_step(double t, double h, const double* x, bool again) override;
  StepEnd end_step(double t, double h, const double* x, double* x_next) override;
  bool had_impact() const override;
  Events* events() override;
  ParticleImpactEvents& impact_events();          // of methods that end their steps at impacts
  ConstrainedImpactEvents& constrained_events();  // likewise, where there are constraints
  // True if methods of equal steps have to end them at events.
  bool cuts_steps(bool implicit, int order) const {
    const bool beside =
        implicit && (order > 2 || (constraint_system_ && constraint_system_->joins_contact()));
    return !contacts().empty() && (beside || contacts().accuracy() == Accuracy::kEvent);
  }
  // Ends a step of a method that only evaluates the system.
  bool end_step(double t, const double* x, double* x_next);
  std::string refusal() const override;
  std::vector<std::string> notes() const override;
  void add_note(std::string note) { notes_.push_back(std::move(note)); }
  void eval(double t, const Stage& stage, double* y, double* dydt) override;
  void combine(const Stage& stage, double* out) override;
  std::unique_ptr<Stepper> explicit_stepper(const ExplicitPlan& plan) override;
  std::unique_ptr<EmbeddedStepper> embedded_stepper(const EmbeddedPlan& plan) override;
  std::unique_ptr<Stepper> split_stepper(const SplitPlan& plan) override;
  // Implicit methods are refused without this.
  void set_implicit_solvers(MakeImplicitSolvers make) { make_solvers_ = std::move(make); }
  std::unique_ptr<StageSolver> stage_solver(const StageOptions& options) override;
  std::unique_ptr<ImplicitExplicitStepper> implicit_explicit_stepper(
      const ImplicitExplicitPlan& plan) override;
  void require_accuracy() const;  // throws where constraints have no such contact
  // The scene's own choice for the force: to be implicit, or explicit, in methods that choose.
  void set_stiff(const Force& force, bool stiff) { stiff_.emplace_back(&force, stiff); }
  std::optional<bool> stiff(const Force& force) const;
  std::unique_ptr<Jacobian> jacobian() override;

 private:
  // True if a step changes positions and velocities only.
  bool is_plain() const { return internal_size() == 0 && prescribed().empty(); }
  void forget_events();
  ImplicitSolvers& solvers();
  StageContact* stage_contact() const { return solvers_ ? solvers_->contact() : nullptr; }
  std::unique_ptr<Stepper> touching(std::unique_ptr<Stepper> stepper, bool first_order);
  bool has_large_nets() const;  // whose numbers lead far
  // The reordering of systems with large nets that have only springs and affine forces; else null.
  const std::shared_ptr<const Reordering>& reordering();

  std::vector<std::pair<const Force*, bool>> stiff_;
  bool changed_between_steps_ = false;
  std::vector<std::string> notes_;                // besides those of its parts
  std::unique_ptr<ParticleImpactEvents> events_;  // if steps end at impacts
  std::unique_ptr<ConstrainedImpactEvents>
      constrained_events_;  // likewise, where there are constraints
  MakeImplicitSolvers make_solvers_;
  std::unique_ptr<ImplicitSolvers> solvers_;             // once a method asked for some
  std::unique_ptr<ConstraintSystem> constraint_system_;  // null without constraints
  std::vector<int> rows_;                                // of places, where nets are large
  std::shared_ptr<const Reordering> reordering_;
  CombineRange combine_range_ = combine_range();
};

}  // namespace sim
