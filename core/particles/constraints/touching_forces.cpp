#include "core/particles/constraints/touching_forces.h"

#include <algorithm>
#include <cmath>

#include "core/particles/axes.h"
#include "core/particles/constraints/linear_rows.h"
#include "core/particles/way.h"

namespace sim {
namespace {

constexpr double kGlance = 1e-5;  // s, for differences
constexpr double kFarther = 1e6;  // of accelerations: what a slip is against them

}  // namespace

TouchingForces::TouchingForces(Particles& particles, const Constraints& constraints, int count)
    : particles_(&particles),
      count_(count),
      solver_(constraints),
      a_(Layout(particles.layout().n(), 3).size()) {}

// What lies on surfaces and does not leave them. Along the normal gap'' = n.a + (n.(v - u))' on the
// straight way is wanted to be 0 or more.
void TouchingForces::find(const ParticleView& now, const Constraints::Axes& a) {
  pushes_.clear();
  double largest = 0;
  for (int i = 0; i < now.n; ++i) largest = std::max(largest, vector_at(a, i).norm());
  for (int i = 0; i < count_; ++i) {
    if (!now.free(i)) continue;
    const Vec3 x = now.position(i), v = now.velocity(i);
    for (Collider* const collider : particles_->contacts().all()) {
      const Touch touch = collider->touch(now.t, x);
      if (!(touch.gap <= kFlush * place_size(x))) continue;
      const Vec3 relative = v - touch.velocity;
      const double fast = v.norm() + touch.velocity.norm(), rate = relative.dot(touch.normal);
      if (rate > kFlush * fast + kFlush) continue;
      const auto rate_after = [&](double after) {
        const Touch then = collider->touch(now.t + after, x + after * v);
        return then.normal.dot(v - then.velocity);
      };
      Push push;
      push.particle = i, push.collider = collider, push.normal = touch.normal;
      push.least = -(rate_after(kGlance) - rate_after(-kGlance)) / (2 * kGlance);
      push.friction = collider->surface().friction;
      // Friction acts against the slip; what does not slip goes with the surface.
      const Vec3 slip = relative - rate * touch.normal;
      if (slip.norm() > kFlush * fast)
        push.ground = -kFarther * largest / slip.norm() * slip;
      else
        push.ground = (collider->touch(now.t + kGlance, x + kGlance * touch.velocity).velocity -
                       collider->touch(now.t - kGlance, x - kGlance * touch.velocity).velocity) /
                      (2 * kGlance);
      pushes_.push_back(push);
    }
  }
}

std::span<const double> TouchingForces::multipliers(const ParticleView& now,
                                                    const RowValues& values) {
  const auto a = Layout(now.n, 3).axes(a_.data());
  const auto fresh = [&] {
    particles_->accelerate(now, a.data());
    particles_->leads().accelerate(now.t, a);
  };
  fresh();
  find(now, a);
  double largest = 1e-30;
  for (int i = 0; i < now.n; ++i) largest = std::max(largest, vector_at(a, i).norm());
  struct Accelerations final : LinearRows {
    using LinearRows::LinearRows;
    double gap(Push& push, const Vec3& y) override { return push.normal.dot(y) - push.least; }
  } wanted(values, a, values.bias());
  wanted.row_tolerance = wanted.gap_tolerance = 1e-15 * largest;
  wanted.enough = 1e-9 * largest;
  wanted.slow = 1e-9 * largest;
  if (!solver_.solve(pushes_, values.gradient(), a, wanted)) {
    fresh();
    solver_.solve({}, values.gradient(), a, wanted);
  }
  return solver_.multipliers();
}

}  // namespace sim
