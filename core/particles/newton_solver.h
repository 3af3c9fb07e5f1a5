// Implicit stages of particles: Newton's method on an incremental potential.
#pragma once

#include <memory>

#include "core/base/array.h"
#include "core/particles/linear_solver.h"
#include "core/particles/particle_system.h"
#include "core/particles/stage_matrix.h"

namespace sim {

// Y = (q, v), r = (r_q, r_v). With q = r_q + tau v the equation Y - tau f(t, Y) = r becomes
//   g(v) = M (v - r_v) + tau c v - tau (F(t, q, v) + m g) = 0
// which for springs, F = -grad U(q), is the gradient of
//   Phi(v) = 1/2 |v - r_v|^2_M + tau/2 c |v|^2 + U(r_q + tau v) - tau m g.v
// Martin, Thomaszewski, Grinspun & Gross (2011), ACM TOG 30(4) 72; Gast, Schroeder, Stomakhin,
// Jiang & Teran (2015), IEEE TVCG 21(10). Newton's direction A d = -g; the length of a step is
// halved until the residual halves or Phi falls. With other forces there is no Phi: the residual
// must fall. Residuals are measured in the norm |g|^2 = g.D^-1 g, D the 3 x 3 blocks on the
// diagonal of A, in which light and heavy particles count alike.
class NewtonSolver final : public StageSolver {
 public:
  NewtonSolver(ParticleSystem& system, const StageOptions& options);

  StepStatus solve(double t, double tau, const double* r, double* y) override;
  Effort effort() const override { return effort_; }
  std::vector<std::string> notes() const override;

 private:
  struct Point {
    double t, tau;
    const double* r;
    double* y;
  };

  void place(const Point& at, double s);  // v := start + s d, q := r_q + tau v
  void gradient(const Point& at);         // of Phi, or g(v)
  double norm();                          // of g
  void linearise(const Point& at, bool clamped);
  void find_direction(const Point& at, double eta);
  bool search(const Point& at, double before);
  double phi(const Point& at) const;
  double dot(const Array& a, const Array& b) const;

  ParticleSystem* system_;
  StageOptions options_;
  Layout half_;
  StageMatrix matrix_;
  std::unique_ptr<LinearSolver> linear_;
  Array g_, z_, d_, start_;
  double slope_ = 0;  // g.d
  Effort effort_;
};

}  // namespace sim
