// The equation of an implicit stage of particles, at one trial velocity after the other.
#pragma once

#include "core/base/array.h"
#include "core/particles/particles.h"
#include "core/particles/velocity_inequality.h"

namespace sim {

// Y = (q, v), r = (r_q, r_v). With q = r_q + tau v the equation Y - tau f(t, Y) = r becomes
//   g(v) = M (v - r_v) + tau c v - tau (F(t, q, v) + m g) = 0
// which for springs, F = -grad U(q), is the gradient of
//   Phi(v) = 1/2 |v - r_v|^2_M + tau/2 c |v|^2 + U(r_q + tau v) - tau m g.v
// Martin, Thomaszewski, Grinspun & Gross (2011), ACM TOG 30(4) 72; Gast, Schroeder, Stomakhin,
// Jiang & Teran (2015), IEEE TVCG 21(10). Vectors have three coordinates a particle, 0 where
// pinned. Prescribed particles obey v = r_v + tau p''. Where velocities have inequalities, trials
// are the nearest allowed ones, friction is in g to first order, and g is projected onto the
// directions along which Phi can fall: projected Newton methods, Bertsekas (1982), SIAM J. Control
// Optim. 20(2).
class StageEquation {
 public:
  explicit StageEquation(Particles& system);

  const Layout& layout() const noexcept { return half_; }
  Array& gradient() noexcept { return g_; }
  const Array& gradient() const noexcept { return g_; }
  Array& direction() noexcept { return d_; }
  double tau() const noexcept { return tau_; }
  std::int64_t evaluations() const noexcept { return evaluations_; }
  ParticleView view() const { return system_->view(t_, y_); }

  void keep_in(VelocityInequalities* bounds) noexcept {
    bounds_ = bounds;
  }  // from begin() on; null: none
  const VelocityInequalities* bounds() const noexcept { return bounds_; }
  bool turned() const noexcept { return turned_; }  // other planes push than one evaluation before

  // Activates the inequalities that the direction would violate: `offset` := the displacements onto
  // their planes, with which it begins. False if there are none.
  bool activates(Array& offset);

  // Begins an equation. Trials are stored in y, on the line from its velocity along direction().
  void begin(double t, double tau, const double* r, double* y);
  void place(double s);  // v := start + s d, q := r_q + tau v
  void start_here();     // start := v
  void evaluate();       // gradient() := g(v)
  double phi();          // J, with springs and affine forces alone
  double phi_rounding() const noexcept { return phi_rounding_; }  // of the last, J
  // Sets the velocities at which trials begin, in layout(); start() returns them.
  void start_at(const Array& velocities);
  const Array& start() const noexcept { return start_; }

  // The change of the acceleration of the stage from its value at the velocities `guess` with the
  // gradient `g`, relative and weighted by masses: |v - guess + g/m| / |v - r_v|.
  double acceleration_change(const Array& guess, const Array& g) const;

 private:
  Particles* system_;
  Layout half_;
  Array g_, d_, start_;
  Array kinematic_;  // accelerations of kinematic particles
  double t_ = 0, tau_ = 0, phi_rounding_ = 0;
  const double* r_ = nullptr;
  double* y_ = nullptr;
  VelocityInequalities* bounds_ = nullptr;
  bool turned_ = false;
  std::int64_t evaluations_ = 0;
};

}  // namespace sim
