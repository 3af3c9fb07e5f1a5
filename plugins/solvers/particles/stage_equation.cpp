#include "stage_equation.h"

#include <algorithm>
#include <cmath>

#include "core/simd/lanes.h"
#include "stage_matrix.h"

namespace sim {

StageEquation::StageEquation(Particles& system)
    : system_(&system),
      half_(system.layout().n(), 3),
      g_(half_.size()),
      d_(half_.size()),
      start_(half_.size()) {
  if (!system.prescribed().empty()) kinematic_ = Array(half_.size());
}

void StageEquation::begin(double t, double tau, const double* r, double* y) {
  t_ = t;
  tau_ = tau;
  r_ = r;
  y_ = y;
  if (!system_->prescribed().empty())
    system_->prescribed().accelerate(t, half_.axes(kinematic_.data()));
  start_here();
  std::ranges::fill(d_.span(), 0.0);
  place(0);
  if (bounds_) start_here();
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
  if (bounds_)
    for (VelocityInequality& bound : *bounds_) {
      const int i = bound.particle;
      const Vec3 kept = bound.nearest({v[0][i], v[1][i], v[2][i]});
      for (std::size_t axis = 0; axis < 3; ++axis) {
        v[axis][i] = kept[axis];
        q[axis][i] = rq[axis][i] + tau_ * kept[axis];
      }
    }
  if (system_->prescribed().empty()) return;
  const auto rv = layout.axes(r_, 3), kinematic = half_.axes(std::as_const(kinematic_).data());
  for (int axis = 0; axis < 3; ++axis)
    for (const int i : system_->prescribed().ids()) {
      v[axis][i] = rv[axis][i] + tau_ * kinematic[axis][i];
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
  if (bounds_) start_here();
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
  turned_ = false;
  if (!bounds_) return;
  for (VelocityInequality& bound : *bounds_) {
    const int i = bound.particle;
    const unsigned before = bound.active;
    const Vec3 left = bound.projected_gradient({g[0][i], g[1][i], g[2][i]}, at.velocity(i));
    for (std::size_t axis = 0; axis < 3; ++axis) g[axis][i] = left[axis];
    turned_ = turned_ || bound.active != before;
  }
}

bool StageEquation::activates(Array& offset) {
  const auto start = half_.axes(std::as_const(start_).data());
  const auto d = half_.axes(std::as_const(d_).data());
  const auto out = half_.axes(offset.data());
  const auto at = [](const std::array<const double*, 3>& axes, int i) {
    return Vec3(axes[0][i], axes[1][i], axes[2][i]);
  };
  bool some = false;
  for (VelocityInequality& bound : *bounds_) {
    const int i = bound.particle;
    some = bound.activates(at(start, i), at(d, i)) || some;
    for (std::size_t axis = 0; axis < 3; ++axis) out[axis][i] = bound.offset[axis];
  }
  return some;
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
  if (bounds_)
    for (const VelocityInequality& bound : *bounds_)
      sum += bound.friction_model.potential(at.velocity(bound.particle));
  const double elastic = system_->elastic_energy(t_, y_);
  phi_rounding_ = 1e-14 * (std::fabs(sum) + size + elastic);
  return sum + elastic;
}

// g(guess) = M (guess - r_v) - tau (..), so guess - g/m is r_v + tau a there.
double StageEquation::acceleration_change(const Array& guess, const Array& g) const {
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

}  // namespace sim
