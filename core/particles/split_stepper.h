// Splitting methods on particles, in one pass over them where the forces allow it.
#pragma once

#include <type_traits>
#include <vector>

#include "core/base/array.h"
#include "core/ode/ode_system.h"
#include "core/particles/own_state.h"
#include "core/particles/particle_system.h"
#include "core/particles/sweeps.h"

namespace sim {

// Each kick is a sweep that evaluates a(t, q), changes v, and drifts q to where the next kick wants
// it. Velocities are changed in place in x_next.
template <class Real>
class SplitStepper final : public Stepper {
 public:
  SplitStepper(ParticleSystem& system, const SplitPlan& plan);

  bool step(double t, double h, const double* x, double* x_next) override;
  void restart() override {
    known_ = false;
    state_.forget();
  }

 private:
  // One stage: an optional kick and the drift after it.
  struct Part {
    double kick, drift, start;  // in units of h; start: where the drifts before it have led
    bool evaluates;
  };

  void write(double h, const Real* x, Real* x_next);
  void damp(KickStage<Real>& stage, std::size_t s, double tau);
  bool gather_and_step(double t, double h, const double* x) requires std::is_same_v<Real, double>;

  ParticleSystem* system_;
  SweepKernels<Real> kernels_ = sweep_kernels<Real>();
  OwnState<Real> state_;
  std::vector<Part> parts_;
  double h_ = 0;        // the step size that the factors of damping are for
  bool closes_;         // the last acceleration is kept for the next step
  bool known_ = false;  // ... and is there
  Sweeps<Real> sweeps_;
  std::vector<KickStage<Real>> stages_;
  ArrayOf<Real> positions_, acceleration_;
  Array forces_;                      // that are neither affine nor springs in runs
  std::vector<Array> keeps_, gains_;  // of each stage, where masses differ
};

}  // namespace sim
