// Linearly implicit stages: each a linear equation with one Jacobian a step.
#pragma once

#include <array>
#include <complex>
#include <memory>
#include <vector>

#include "core/base/array.h"
#include "core/ode/ode_system.h"
#include "pair_stages.h"

namespace sim {

// A Rosenbrock pair for x' = f(t, x) in the variables of Kaps & Rentrop, which multiply with J no
// vector (Hairer & Wanner, Solving ODEs II (1996), equations IV.7.16 and IV.7.25):
//   (1 / (h gamma) - J) u_i = f(t + alpha_i h, x + sum_{j<i} a_ij u_j) + sum_{j<i} c_ij u_j / h
//                             + h gamma_i df/dt,      J = df/dx and df/dt at (t, x)
//   x_next = x + sum_j a_Sj u_j + u_S,  u_S is its error: the last stage is at the end of the step
// Theta of the way through a step, with the rows d_0 and d_1 of `dense`:
//   (1 - theta) x + theta (x_next + (1 - theta) sum_j (d_0j + theta d_1j) u_j)
// The cubic of Hermite would take f at states off by delta, which is off by lambda delta.
struct RosenbrockPair {
  static constexpr int kStages = 6;
  using Row = std::array<double, kStages>;
  double gamma = 0;
  std::array<Row, kStages> a, c;
  Row alpha, gammas;
  std::array<Row, 2> dense;
};

class RosenbrockStages final : public PairStages {
 public:
  explicit RosenbrockStages(const RosenbrockPair& pair) : pair_(pair) {}

  // Throws Error{kScene} for a system that does not know the entries of its Jacobian.
  void prepare(OdeSystem& system) override;
  void restart() override { linearised_ = false; }
  StepStatus step(OdeSystem& system, double t, double h, const double* x, const double* slope,
                  double* y, double* error) override;
  void last_slope(OdeSystem& system, double t, double h, const double* y, double* slope) override;
  void interpolate(double theta, const PairStep& step, double* out) const override;
  bool step_inside(OdeSystem& system, double t, double h, const PairStep& step,
                   double* out) override;
  std::vector<double> memory() const override;
  bool recall(std::span<const double> memory) override;
  Effort effort() const override { return (solver_ ? solver_->effort() : Effort{}) + own_; }
  double amplification(double h_omega, double h_gamma) const override;

 private:
  void linearise(OdeSystem& system, double t, const double* x, const double* slope);
  std::complex<double> stability_function(std::complex<double> z) const;

  RosenbrockPair pair_;
  std::unique_ptr<LinearisedSolver> solver_;
  bool linearised_ = false;  // at the start of the step that is tried
  double tau_ = 0;           // of the factors; 0: there are none
  std::vector<Array> u_;
  std::array<Array, 2> bend_;  // the sums of dense output over u, of the accepted step
  Array time_slope_, slope_;   // df/dt at the start; f of a stage
  Effort own_;
};

}  // namespace sim
