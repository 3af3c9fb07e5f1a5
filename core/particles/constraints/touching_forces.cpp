#include "core/particles/constraints/touching_forces.h"

#include <algorithm>
#include <cmath>

#include "core/particles/axes.h"
#include "core/particles/constraints/linear_rows.h"
#include "core/particles/way.h"

namespace sim {
namespace {

constexpr double kGlanceOfForces = 1e-5;  // s, for differences, of those who look
constexpr double kFarther = 1e8;          // of accelerations: what a slip is against them
constexpr double kCreeps = 1e-12;         // of accelerations: a slip that is none
constexpr double kCreeping = 1e-7;        // m/s, to those who look
constexpr double kAsGood = 1e-7;          // of accelerations: what is wrong with those that do
constexpr double kGainsNoMore = 1e-9;     // likewise, where turns gain no more

// d/dt of what f says after a time, by three values.
template <class F>
auto rate_of(const F& f, double d) {
  return (4 * f(d) - f(2 * d) - 3 * f(0)) * (1 / (2 * d));
}

// Along the normal gap'' = n.a + (n.(v - u))' on the straight way is wanted to be 0 or more.
// Friction acts against the slip; what does not slip goes with the surface.
Push push_of(const LyingOn& lying, const ParticleView& now, double d, double largest) {
  const int i = lying.particle;
  const Collider& collider = *lying.collider;
  const Vec3 x = now.position(i), v = now.velocity(i);
  const Touch touch = collider.touch(now.t, x);
  Push push;
  push.particle = i, push.collider = lying.collider, push.normal = touch.normal;
  push.least = -rate_of(
      [&](double after) {
        const Touch then = collider.touch(now.t + after, x + after * v);
        return then.normal.dot(v - then.velocity);
      },
      d);
  const Vec3 slip = tangential(v - touch.velocity, touch.normal);
  push.friction = collider.surface().friction_at(lying.slides ? slip.norm() : 0);
  if (lying.slides && slip.squaredNorm() > 0)
    push.ground = -kFarther * largest / slip.norm() * slip;
  else if (push.friction > 0)
    push.ground = rate_of(
        [&](double after) {
          return collider.touch(now.t + after, x + after * touch.velocity).velocity;
        },
        d);
  return push;
}

double largest_of(const Constraints::Axes& a, int n) {
  double largest = 1e-30;
  for (int i = 0; i < n; ++i) largest = std::max(largest, vector_at(a, i).norm());
  return largest;
}

}  // namespace

TouchingForces::TouchingForces(Particles& particles, const Constraints& constraints, int count)
    : particles_(&particles),
      constraints_(&constraints),
      count_(count),
      solver_(constraints),
      a_(Layout(particles.layout().n(), 3).size()) {}

void TouchingForces::free(const ParticleView& now, const Constraints::Axes& a) const {
  particles_->accelerate(now, a.data());
  particles_->leads().accelerate(now.t, a);
}

bool TouchingForces::accelerate(const ParticleView& now, const RowValues& values,
                                std::span<const LyingOn> lying, const Look& look,
                                const Constraints::Axes& a) {
  const double largest = largest_of(a, now.n);
  pushes_.clear();
  for (const LyingOn& each : lying) {
    pushes_.push_back(push_of(each, now, look.glance, largest));
    pushes_.back().acts = each.surplus > 0;  // as at the start
    if (!look.rubs) pushes_.back().friction = 0;
  }
  struct Accelerations final : LinearRows {
    using LinearRows::LinearRows;
    double gap(Push& push, const Vec3& y) override { return push.normal.dot(y) - push.least; }
  } wanted(values, a, values.bias());
  wanted.row_tolerance = wanted.gap_tolerance = 1e-15 * largest;
  wanted.enough = kGainsNoMore * largest;
  wanted.slow = kCreeps * largest;
  if (solver_.solve(pushes_, values.gradient(), a, wanted)) return true;
  return std::max(solver_.worst().row, -solver_.worst().gap) <= kAsGood * largest;
}

double TouchingForces::surplus(std::size_t k) const {
  const Push& push = pushes_[k];
  const double weight = constraints_->weights()[static_cast<std::size_t>(push.particle)];
  return push.acts ? weight * push.force : -push.gap;
}

// What lies on surfaces and does not leave them.
void TouchingForces::find(const ParticleView& now) {
  lying_.clear();
  for (int i = 0; i < count_; ++i) {
    if (!now.free(i)) continue;
    const Vec3 x = now.position(i), v = now.velocity(i);
    for (Collider* const collider : particles_->contacts().all()) {
      const Touch touch = collider->touch(now.t, x);
      if (!(touch.gap <= kFlush * place_size(x))) continue;
      const Vec3 relative = v - touch.velocity;
      const double fast = v.norm() + touch.velocity.norm(), rate = relative.dot(touch.normal);
      if (rate > kFlush * fast + kFlush) continue;
      const Vec3 slip = relative - rate * touch.normal;
      lying_.push_back(
          {.particle = i, .collider = collider, .slides = slip.norm() > kFlush * fast + kCreeping});
    }
  }
}

std::span<const double> TouchingForces::multipliers(const ParticleView& now,
                                                    const RowValues& values) {
  const auto a = Layout(now.n, 3).axes(a_.data());
  free(now, a);
  find(now);
  if (!accelerate(now, values, lying_, {.glance = kGlanceOfForces}, a)) {
    free(now, a);
    accelerate(now, values, {}, {.glance = kGlanceOfForces}, a);
  }
  return solver_.multipliers();
}

}  // namespace sim
