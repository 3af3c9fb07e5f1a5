// Explicit Runge-Kutta on particles: one pass a stage, or all stages in one pass.
#pragma once

#include <optional>
#include <type_traits>
#include <vector>

#include "core/base/array.h"
#include "core/ode/ode_system.h"
#include "core/particles/explicit/contact_pass.h"
#include "core/particles/explicit/precision_state.h"
#include "core/particles/explicit/sweeps.h"
#include "core/particles/particles.h"

namespace sim {

// With k_i = (v_i, a_i) only the accelerations have to be stored (Hairer, Norsett & Wanner, Solving
// ODEs I (1993), section II.14: the Nystrom form of a Runge-Kutta method):
//   v_i = v + h sum_j a_ij a_j
//   q_i = q + h c_i v + h^2 sum_j (A^2)_ij a_j
//   q_next = q + h v + h^2 sum_j (b A)_j a_j,  v_next = v + h sum_j b_j a_j
template <class Real>
class RkStepper final : public Stepper {
 public:
  // If `kept` has arrays, they receive the accelerations of all stages, and provide that of stage
  // 0.
  RkStepper(Particles& system, const ExplicitPlan& plan, std::span<ArrayOf<Real>> kept = {});

  bool step(double t, double h, int count, const double* x, double* x_next) override;
  int at_once() const override { return state_.at_once(); }
  void restart() override { state_.forget(); }

 private:
  // The stages of a step of size h between two states, which alternate from step to step.
  struct Script {
    double h = 0;
    const Real* x = nullptr;
    Real* x_next = nullptr;
    std::vector<RkStage<Real>> stages;

    bool fits(double size, const Real* from, const Real* to) const {
      return h == size && x == from && x_next == to;
    }
  };

  void write(Script& script, double h, const Real* x, Real* x_next);
  // Stage s as other forces see it, in double alone.
  ParticleView view(double t, double h, const double* x, const Script& script, int s) const;
  bool gather_and_step(double t, double h, const double* x, const Script& script);
  bool sweep_and_step(double t, double h, const double* x, const Script& script);
  // Particles [begin, end) of stage s, whose other forces are gathered.
  bool end_sweep(double t, const Script& script, Rings<Real>& rings, int s, int begin, int end);

  // Resolves contact of the particles [begin, end) at the end of a step.
  void resolve(double t, const Script& script, int begin, int end);

  static const RkStage<Real>& at(const Script& script, int s) {
    return script.stages[static_cast<std::size_t>(s)];
  }
  // Null for a stage that evaluates no forces.
  static const Real* const* positions(const Script& script, int s) {
    return at(script, s).q[0] ? at(script, s).q : nullptr;
  }

  Particles* system_;
  SweepKernels<Real> kernels_ = sweep_kernels<Real>();
  PrecisionState<Real> state_;
  ExplicitPlan plan_;
  int stages_;
  Sweeps<Real> sweeps_;
  std::vector<ArrayOf<Real>> own_;  // accelerations of stages 1 ..; those of stage 0 lie in x_next
  std::span<ArrayOf<Real>> kept_;   // or all of them
  ArrayOf<Real> positions_;         // of every other stage; the rest lie in x_next
  Array velocities_[2], forces_;    // for forces that are neither affine nor springs in runs
  Script scripts_[2];
  std::optional<ParticleContactPass> contact_pass_;  // if there are colliders
};

}  // namespace sim
