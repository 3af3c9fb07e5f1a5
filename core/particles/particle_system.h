// Particles as a system X' = f(t, X): which stepper or solver a plan gets.
#pragma once

#include "core/ode/ode_system.h"
#include "core/particles/constraints/holding.h"
#include "core/particles/particles.h"

namespace sim {

class Renumbering;
class ContactEvents;
class HeldEvents;
class StepContact;

class ParticleSystem final : public OdeSystem, public Particles {
 public:
  ParticleSystem(const std::vector<double>& masses, const std::vector<int>& pinned,
                 std::vector<std::unique_ptr<Force>> forces, const double* initial, Team& team);
  ~ParticleSystem() override;

  // Explicit methods of fixed steps may take particles in another order, that of places, where nets
  // are large. Their steppers are made after this.
  void order_by(const ParticleView& initial);

  std::size_t size() const noexcept override {
    return layout().size() + memory_size() + (holding_ ? holding_->memory_size() : 0);
  }
  StateShape shape() const override;

  // Makes room for constraints, which may then be added; null where there are none.
  Holding& hold();
  Holding* holding() const noexcept { return holding_.get(); }
  void set_masses(const std::vector<double>& masses, const std::vector<int>& pinned,
                  bool some_move = false);

  bool confined() const noexcept override { return !contacts().empty() || holding_; }
  bool settle(double t, double* x) override;
  const double* begin_step(double t, double h, const double* x, bool again) override;
  StepEnd end_step(double t, double h, const double* x, double* x_next) override;
  bool jumped() const override;
  Events* events() override;
  // Methods of equal steps are to end them at events.
  bool cuts_steps(bool implicit, int order) const {
    const bool beside = implicit && (order > 2 || (holding_ && holding_->joins_contact()));
    return !contacts().empty() && (beside || contacts().accuracy() == Accuracy::kEvent);
  }
  // The end of a step of a method that evaluates the system alone.
  bool end_step(double t, const double* x, double* x_next);
  std::string refusal() const override;
  std::vector<std::string> notes() const override;
  void add_note(std::string note) { notes_.push_back(std::move(note)); }
  void eval(double t, const Stage& stage, double* y, double* dydt) override;
  void combine(const Stage& stage, double* out) override;
  std::unique_ptr<Stepper> explicit_stepper(const ExplicitPlan& plan) override;
  std::unique_ptr<EmbeddedStepper> embedded_stepper(const EmbeddedPlan& plan) override;
  std::unique_ptr<Stepper> split_stepper(const SplitPlan& plan) override;
  std::unique_ptr<StageSolver> stage_solver(const StageOptions& options) override;
  std::unique_ptr<Jacobian> jacobian() override;

 private:
  // Positions and velocities are all that a step changes.
  bool is_plain() const { return memory_size() == 0 && leads().empty(); }
  void forget_events();
  StageOptions sparing(StageOptions options) const;
  std::unique_ptr<StageSolver> particle_solver(const StageOptions& options, StepContact* contact);
  void require_accuracy() const;  // throws where constraints have no such contact
  HeldEvents& held_events();
  std::unique_ptr<Stepper> touching(std::unique_ptr<Stepper> stepper, bool first_order);
  bool has_large_nets() const;  // whose numbers lead far
  // Of large nets that do without all but springs and affine forces; else null.
  const std::shared_ptr<const Renumbering>& renumbering();

  std::vector<std::string> notes_;             // besides those of its parts
  std::unique_ptr<ContactEvents> events_;      // where steps are cut
  std::unique_ptr<HeldEvents> held_events_;    // likewise, where there are constraints
  std::unique_ptr<StepContact> step_contact_;  // of implicit methods, where there are colliders
  std::unique_ptr<Holding> holding_;           // where there are constraints
  std::vector<int> rows_;                      // of places, where nets are large
  std::shared_ptr<const Renumbering> renumbering_;
  CombineRange combine_range_ = combine_range();
};

}  // namespace sim
