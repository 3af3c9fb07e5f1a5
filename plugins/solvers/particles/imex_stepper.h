// Steps of particles that are implicit in the stiff forces alone.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/base/array.h"
#include "core/ode/ode_system.h"
#include "core/particles/explicit/internal_drift.h"
#include "discrete_gradient.h"
#include "newton_solver.h"
#include "stiff_part.h"

namespace sim {

// The soft part is a system of all particles, whose accelerations make the kicks; the stiff part is
// a system of the particles that it acts on, which take a step that keeps their energy, or one of
// the implicit midpoint rule; the others drift. With colliders the stage is one of all particles,
// with contact as in implicit methods.
class ImexStepper final : public ImplicitExplicitStepper {
 public:
  // The particles of the system, and their contacts if there are colliders, else null.
  ImexStepper(OdeSystem& system, Particles& particles, StiffPart::Said said,
              ImplicitContact* contact, const ImplicitExplicitPlan& plan);

  void choose_partition(double t, double h, const double* x) override;
  std::vector<double> memory() const override;
  bool recall(std::span<const double> memory) override;
  Advance advance(double t, double h, std::int64_t most, const double* x, double* x_next) override;
  void restart() override;
  OdeSystem* soft_part() override { return soft_.get(); }
  bool is_all_stiff() const override;
  Effort effort() const override;
  std::vector<std::string> notes() const override;

 private:
  void make(const Partition& partition, const double* x);
  void make_solver();
  StepStatus step(double t, double h, const double* x, double* x_next);
  void set_step_size(double h);
  void kick(double t, double* state, bool first);
  void change(std::size_t slot, const double* const v[3], double* const to[3]);
  StepStatus drift(double t, double h, double* state);

  OdeSystem* system_;
  Particles* particles_;
  ImplicitContact* contact_;
  ImplicitExplicitPlan plan_;
  StiffPart parts_;
  Partition partition_;
  PartitionCount count_;
  std::unique_ptr<Stepper> verlet_;  // if nothing is stiff
  std::unique_ptr<SoftSystem> soft_;
  std::unique_ptr<Particles> stiff_;
  // One of them: springs alone whose graph has sparse factors keep their energy.
  std::unique_ptr<DiscreteGradientSolver> springs_;
  std::unique_ptr<NewtonSolver> solver_;
  std::unique_ptr<ThreadPool> own_pool_;  // of a stiff part that is small
  std::vector<int> ids_;                  // of its particles; empty: all
  Layout half_, one_;
  Array a_, v_half_, r_, y_;   // accelerations; velocities in the middle of a kick; of the stage
  Array keeps_[2], gains_[2];  // of kicks of h/2 and h/4, of every particle
  std::optional<InternalDrift> internal_;
  double h_ = 0;
  int substeps_ = 1;    // of the stiff part
  bool known_ = false;  // the last accelerations of a step are the first of the next
  std::int64_t steps_ = 0, evaluations_ = 0;
  Effort past_;
};

}  // namespace sim
