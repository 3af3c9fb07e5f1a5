#include "core/particles/implicit/stage_equation.h"

#include <algorithm>
#include <cmath>

#include "core/simd/lanes.h"

namespace sim {

StageEquation::StageEquation(Particles& system)
    : system_(&system),
      half_(system.layout().n(), 3),
      g_(half_.size()),
      d_(half_.size()),
      start_(half_.size()) {
  if (!system.leads().empty()) led_ = Array(half_.size());
}

void StageEquation::begin(double t, double tau, const double* r, double* y) {
  t_ = t;
  tau_ = tau;
  r_ = r;
  y_ = y;
  if (!system_->leads().empty()) system_->leads().accelerate(t, half_.axes(led_.data()));
  start_here();
  std::ranges::fill(d_.span(), 0.0);
  place(0);
}

void StageEquation::place(double s) {
  const Layout& layout = system_->layout();
  const auto rq = layout.axes(r_), start = half_.axes(std::as_const(start_).data());
  const auto d = half_.axes(std::as_const(d_).data());
  const auto q = layout.axes(y_), v = layout.axes(y_, 3);
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < layout.n(); ++i) {
      v[axis][i] = start[axis][i] + s * d[axis][i];
      q[axis][i] = rq[axis][i] + tau_ * v[axis][i];
    }
  if (system_->leads().empty()) return;
  const auto rv = layout.axes(r_, 3), led = half_.axes(std::as_const(led_).data());
  for (int axis = 0; axis < 3; ++axis)
    for (const int i : system_->leads().ids()) {
      v[axis][i] = rv[axis][i] + tau_ * led[axis][i];
      q[axis][i] = rq[axis][i] + tau_ * v[axis][i];
    }
}

void StageEquation::start_here() {
  const auto start = half_.axes(start_.data()), v = system_->layout().axes(y_, 3);
  for (int axis = 0; axis < 3; ++axis) std::copy_n(v[axis], half_.n(), start[axis]);
}

void StageEquation::start_at(const Array& velocities) {
  std::ranges::copy(velocities.span(), start_.data());
  place(0);
}

void StageEquation::evaluate() {
  const ParticleView at = view();
  const auto g = half_.axes(g_.data());
  system_->accelerate(at, g.data());
  ++evaluations_;
  const auto rv = system_->layout().axes(r_, 3);
  const auto v = system_->layout().axes(y_, 3);
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < at.n; ++i)
      g[axis][i] = at.free(i) ? at.mass[i] * ((v[axis][i] - rv[axis][i]) - tau_ * g[axis][i]) : 0.0;
}

double StageEquation::phi() {
  const ParticleView at = view();
  const Motion& motion = system_->motion();
  const auto rv = system_->layout().axes(r_, 3);
  const Vec3 gravity(motion.gravity[0], motion.gravity[1], motion.gravity[2]);
  double sum = 0, size = 0;
  for (int i = 0; i < at.n; ++i) {
    if (!at.free(i)) continue;
    const Vec3 v = at.velocity(i), change = v - Vec3(rv[0][i], rv[1][i], rv[2][i]);
    const double weight = tau_ * at.mass[i] * gravity.dot(v);
    sum += at.mass[i] * 0.5 * change.squaredNorm() - weight +
           0.5 * tau_ * motion.damping * v.squaredNorm();
    size += std::fabs(weight);
  }
  const double elastic = system_->elastic_energy(t_, y_);
  phi_rounding_ = 1e-14 * (std::fabs(sum) + size + elastic);
  return sum + elastic;
}

// g(guess) = M (guess - r_v) - tau (..), so guess - g/m is r_v + tau a there.
double StageEquation::surprise(const Array& guess, const Array& g) const {
  const ParticleView at = view();
  const auto rv = system_->layout().axes(r_, 3);
  const auto from = half_.axes(guess.data()), slope = half_.axes(g.data());
  const double* const v[3] = {at.vx, at.vy, at.vz};
  double change = 0, all = 0;
  for (int i = 0; i < at.n; ++i) {
    if (!at.free(i)) continue;
    for (int axis = 0; axis < 3; ++axis) {
      const double own = v[axis][i] - from[axis][i] + slope[axis][i] / at.mass[i];
      const double whole = v[axis][i] - rv[axis][i];
      change += at.mass[i] * own * own;
      all += at.mass[i] * whole * whole;
    }
  }
  return all > 0 ? std::sqrt(change / all) : 0;
}

double dot(const Array& a, const Array& b) {
  return sum_in_lanes(std::size_t{0}, a.size(), [&](std::size_t i) { return a[i] * b[i]; });
}

}  // namespace sim
