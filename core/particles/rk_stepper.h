// Explicit Runge-Kutta on particles: one pass a stage, or all stages in one pass.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "core/base/array.h"
#include "core/ode/ode_system.h"
#include "core/particles/particle_system.h"

namespace sim {

// With k_i = (v_i, a_i) only the accelerations have to be kept (Hairer, Norsett & Wanner, Solving
// ODEs I (1993), section II.14: the Nystrom form of a Runge-Kutta method):
//   v_i = v + h sum_j a_ij a_j
//   q_i = q + h c_i v + h^2 sum_j (A^2)_ij a_j
//   q_next = q + h v + h^2 sum_j (b A)_j a_j,  v_next = v + h sum_j b_j a_j
//
// A stage at particle i reads positions up to i + reach only. So stage s may run over the particles
// while stage s - 1 is `reach` ahead, and the data of all stages stay in cache: a wavefront. Rank r
// of a team takes the particles from m_r + s reach on at stage s: cut at that slant, it never waits
// for the rank below, and that one finds what it needs when it gets there.
class RkStepper final : public ExplicitStepper {
 public:
  RkStepper(ParticleSystem& system, const ExplicitPlan& plan);

  bool step(double t, double h, const double* x, double* x_next) override;

 private:
  // The stages of a step of size h between two states, which alternate from step to step.
  struct Script {
    double h = 0;
    const double* x = nullptr;
    double* x_next = nullptr;
    std::vector<RkStage> stages;
  };
  struct alignas(64) Progress {
    std::atomic<int> done{0};  // this stage is finished for the particles of its rank below `done`
  };

  void write(Script& script, double h, const double* x, double* x_next);
  void run_plain(double t);
  void run_wavefront(int rank);
  int first(int rank, int stage) const;
  void start(int rank, int stage, int begin);
  void sweep(int rank, int stage, int begin, int end);
  Rings& rings(int rank, int stage);
  Progress& progress(int rank, int stage) { return progress_[rank * stages_ + stage]; }

  ParticleSystem* system_;
  SweepKernels kernels_;
  ExplicitPlan plan_;
  int stages_, ranks_;
  bool one_pass_;  // all stages in one pass, with rings of their own

  std::vector<Array> kept_;       // accelerations of stages 1 ..; those of stage 0 lie in x_next
  Array positions_;               // of every other stage; the rest lie in x_next
  Array velocities_[2], forces_;  // for forces that are neither affine nor springs in runs
  Script scripts_[2];
  const Script* script_ = nullptr;  // of the step being taken
  std::vector<Rings> rings_;
  std::unique_ptr<Progress[]> progress_;
  std::vector<char> finite_;  // of each rank
};

}  // namespace sim
