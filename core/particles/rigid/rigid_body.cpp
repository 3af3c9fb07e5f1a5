#include "core/particles/rigid/rigid_body.h"

#include <cmath>

#include "core/base/error.h"

namespace sim {

// Quaternion from the largest of its four components, which avoids cancellation (Shepperd (1978),
// J. Guidance Control 1, 223).
std::array<double, 4> RigidState::quaternion() const {
  const Mat3& r = axes;
  const double trace = r(0, 0) + r(1, 1) + r(2, 2);
  const double squares[] = {trace, r(0, 0), r(1, 1), r(2, 2)};
  std::size_t most = 0;
  for (std::size_t k = 1; k < 4; ++k)
    if (squares[k] > squares[most]) most = k;
  std::array<double, 4> q{};
  const double four =
      2 * std::sqrt(std::max(0.0, most == 0 ? 1 + trace : 1 + 2 * squares[most] - trace));
  q[most] = four / 4;
  const double difference[] = {r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)};
  for (std::size_t k = 0; k < 3; ++k) {
    if (most == 0) {
      q[k + 1] = difference[k] / four;
    } else if (k + 1 != most) {
      q[k + 1] = (r(k, most - 1) + r(most - 1, k)) / four;
    }
  }
  if (most > 0) q[0] = difference[most - 1] / four;
  if (q[0] < 0)
    for (double& each : q) each = -each;
  return q;
}

RigidBody::RigidBody(std::shared_ptr<const RigidShape> shape, double mass, int first)
    : shape_(std::move(shape)), mass_(mass), first_(first) {
  const MassProperties bulk = mass_properties(*shape_);
  center_ = bulk.center;
  const PrincipalAxes principal = principal_axes(bulk.covariance / bulk.volume);
  principal_ = principal.columns;
  for (std::size_t k = 0; k < 3; ++k) extent_[k] = std::sqrt(std::max(0.0, principal.values[k]));
  const double most = extent_.maxCoeff();
  for (std::size_t k = 0; k < 3; ++k)
    if (!(extent_[k] > 1e-6 * most) || !std::isfinite(most))
      throw Error(ErrorKind::kScene,
                  {"rigid body", "", "its shape has no thickness in one direction",
                   "make it at least a millionth of its length thick"});
  for (std::size_t k = 0; k < 3; ++k) share_[k] = 1 / (4 * extent_[k]);
}

double RigidBody::radius() const { return radius_about(*shape_, center_); }

Vec3 RigidBody::moments() const {
  const Vec3& a = extent_;
  return mass_ *
         Vec3(a[1] * a[1] + a[2] * a[2], a[2] * a[2] + a[0] * a[0], a[0] * a[0] + a[1] * a[1]);
}

Mat3 RigidBody::inertia(const RigidState& state) const {
  const Mat3 d = state.axes * principal_;
  return d * Mat3::Diagonal(moments()) * transposed(d);
}

Mat3 RigidBody::inverse_inertia(const RigidState& state) const {
  const Vec3 m = moments();
  const Mat3 d = state.axes * principal_;
  return d * Mat3::Diagonal({1 / m[0], 1 / m[1], 1 / m[2]}) * transposed(d);
}

Vec3 RigidBody::corner(const RigidState& state, int particle) const {
  Vec3 local;
  for (std::size_t k = 0; k < 3; ++k) local[k] = sign(particle, k) * extent_[k];
  return state.axes * (principal_ * local);
}

std::array<double, 4> RigidBody::weights(const Vec3& at) const {
  const Vec3 local = transposed(principal_) * (at - center_);
  std::array<double, 4> w{};
  for (int p = 0; p < kParticles; ++p) {
    double sum = 1;
    for (std::size_t k = 0; k < 3; ++k) sum += sign(p, k) * local[k] / extent_[k];
    w[static_cast<std::size_t>(p)] = 0.25 * sum;
  }
  return w;
}

Directors RigidBody::directors(const ParticleView& view, const Vec3& x0, const Vec3& v0) const {
  Directors directors;
  for (int p = 0; p < kParticles; ++p) {
    const Vec3 x = view.position(first_ + p) - x0, v = view.velocity(first_ + p) - v0;
    for (std::size_t k = 0; k < 3; ++k) {
      directors.d[k] += sign(p, k) * share_[k] * x;
      directors.rate[k] += sign(p, k) * share_[k] * v;
    }
  }
  return directors;
}

// From d_k' = spin x d_k follows spin = 1/2 sum d_k x d_k'.
RigidState RigidBody::state(const ParticleView& view) const {
  RigidState state;
  for (int p = 0; p < kParticles; ++p) {
    state.center += 0.25 * view.position(first_ + p);
    state.velocity += 0.25 * view.velocity(first_ + p);
  }
  auto [d, rate] = directors(view, state.center, state.velocity);
  // Orthonormal to the last bit, for pictures and reports.
  d[0] = d[0].normalized();
  d[1] = (d[1] - d[1].dot(d[0]) * d[0]).normalized();
  d[2] = d[0].cross(d[1]);
  for (std::size_t k = 0; k < 3; ++k) state.angular_velocity += 0.5 * d[k].cross(rate[k]);
  state.axes = transposed({d[0], d[1], d[2]}) * transposed(principal_);
  return state;
}

RenderShape RigidBody::drawn(const RigidState& state) const {
  RenderShape solid;
  solid.center = place(state, {});
  solid.radius = shape_->radius;
  solid.body = true;
  for (std::size_t k = 0; k < 3; ++k) solid.axes[k] = state.axes.column(k);
  switch (shape_->form) {
    case RigidShape::Form::kSphere:
      solid.form = RenderShape::Form::kSphere;
      break;
    case RigidShape::Form::kBox:
      solid.form = RenderShape::Form::kBox;
      for (std::size_t k = 0; k < 3; ++k) solid.axes[k] *= shape_->half[k];
      break;
    case RigidShape::Form::kCapsule:
      solid.form = RenderShape::Form::kCapsule;
      solid.axes = {0.5 * shape_->length * state.axes.column(1), state.axes.column(2),
                    state.axes.column(0)};
      break;
    case RigidShape::Form::kMesh:
    case RigidShape::Form::kCompound:
      solid.form = RenderShape::Form::kMesh;
      solid.mesh = shape_;
      for (const Vec3& point : shape_->points) solid.radius = std::max(solid.radius, point.norm());
      break;
  }
  return solid;
}

}  // namespace sim
