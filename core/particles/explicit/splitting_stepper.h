// Splitting methods on particles, in one pass over them where the forces allow it.
#pragma once

#include <array>
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

// Each kick is a sweep that evaluates a(t, q), changes v, and drifts q to where the next kick needs
// it. If the last acceleration of a step is the first of the next, that sweep makes both kicks: the
// next step begins with a drift, and of several steps at once each but the first is one sweep.
template <class Real>
class SplittingStepper final : public Stepper {
 public:
  SplittingStepper(Particles& system, const SplitPlan& plan);

  bool step(double t, double h, int count, const double* x, double* x_next) override;
  int at_once() const override;
  void restart() override {
    known_ = false;
    state_.forget();
  }
  bool midpoint_kicks() const override { return system_->needs_velocities(); }

 private:
  static constexpr int kStagesAtOnce = 16;  // more gain little

  // A stage of one step: an optional kick and the drift after it.
  struct Part {
    double kick, drift, start;  // in units of h; start: the sum of the drifts before it
    bool kicks;
  };

  // The time and velocities at which a stage evaluates the other forces.
  struct Moment {
    double start;      // as in Part
    const Real* v[3];  // null where none of them depends on velocity
  };

  // The contact pass after a stage; null arrays without one.
  struct ContactStage {
    double start = 0;  // of the step, in units of h
    bool holds = false, drifts = false, ends = false;
    std::array<const double*, 3> q = {}, v0 = {};  // before a drift
    std::array<double*, 3> q_next = {}, v_half = {};
    std::array<double*, 3> v = {},
                           v_after = {};  // after the second kick, and after the one that follows
  };

  static std::vector<Part> parts_of(const SplitPlan& plan);
  void set_step_size(double h);
  Kick kick(std::size_t slot, double tau);
  void write(int count, const Real* x, Real* x_next);
  bool gather_and_step(double t, const double* x);  // in double alone
  ContactStage contact_of(int step, std::size_t part, const KickStage<Real>& stage, const Real* x,
                          Real* x_next);
  bool kick(Rings<Real>& rings, std::size_t s, int begin, int end);
  void resolve(std::size_t s, int begin, int end);
  bool contact_succeeded() const { return !contact_pass_ || contact_pass_->succeeded(); }

  Particles* system_;
  SweepKernels<Real> kernels_ = sweep_kernels<Real>();
  PrecisionState<Real> state_;
  std::vector<Part> parts_;
  std::ptrdiff_t drifts_;  // of a step, that are not 0
  double h_ = 0;           // the step size that the kicks are for
  bool contact_inside_;    // between the kicks of a step and after them, or at its end
  bool closes_;            // the last kick of a step and the first of the next are made at once
  bool known_ = false;     // ... and were, into v_after_
  Sweeps<Real> sweeps_;
  std::vector<Kick> kicks_;  // of the parts, and then their first halves for midpoint kicks
  std::vector<KickStage<Real>> stages_;
  std::vector<Moment> moments_;  // of the stages
  ArrayOf<Real> positions_, v_after_;
  ArrayOf<Real> a_;                   // if there are colliders, to repeat a kick
  Array forces_;                      // that are neither affine nor springs in runs
  ArrayOf<Real> v_half_;              // in the middle of a kick, where forces depend on velocity
  std::vector<Array> keeps_, gains_;  // of the kicks, where masses differ
  std::optional<ParticleContactPass> contact_pass_;  // if there are colliders
  double t_ = 0;                                     // s, where the steps begin
  std::vector<ContactStage> contacts_;               // of the stages
};

}  // namespace sim
