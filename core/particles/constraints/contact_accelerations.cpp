#include "core/particles/constraints/contact_accelerations.h"

#include <algorithm>
#include <cmath>

#include "core/math/axes.h"
#include "core/particles/constraints/linear_rows.h"
#include "core/particles/step_path.h"

namespace sim {
namespace {

constexpr double kGlanceOfForces = 1e-5;  // s, for differences, of those who look
constexpr double kFarther = 1e8;          // times the accelerations, as the scale of a slip
constexpr double kCreeps = 1e-12;         // of accelerations: a slip that is none
constexpr double kCreeping = 1e-7;        // m/s, to those who look
constexpr double kAsGood = 1e-7;          // of accelerations: an acceptable residual
constexpr double kGainsNoMore = 1e-9;     // likewise, where turns gain no more

// The time derivative of f by a one-sided difference of second order, with three values.
template <class F>
auto rate_of(const F& f, double d) {
  return (4 * f(d) - f(2 * d) - 3 * f(0)) * (1 / (2 * d));
}

// The acceleration-level contact condition: gap'' = n.a + (n.(v - u))' >= 0 along the straight
// path. Friction opposes the slip; a sticking particle accelerates with the surface.
ContactForce push_of(const RestingContact& resting, const ParticleView& now, double d,
                     double largest) {
  const int i = resting.particle;
  const SupportSurface& surface = resting.surface;
  const Vec3 x = now.position(i), v = now.velocity(i);
  const SurfaceSample sample = surface.query(now.t, x);
  ContactForce contact;
  contact.particle = i, contact.collider = surface.collider, contact.normal = sample.normal;
  contact.min_velocity = -rate_of(
      [&](double after) {
        const SurfaceSample then = surface.query(now.t + after, x + after * v);
        return then.normal.dot(v - then.velocity);
      },
      d);
  const Vec3 slip = tangential(v - sample.velocity, sample.normal);
  contact.friction = surface.collider->material().friction_at(resting.slides ? slip.norm() : 0);
  if (resting.slides && slip.squaredNorm() > 0)
    contact.surface_velocity = -kFarther * largest / slip.norm() * slip;
  else if (contact.friction > 0)
    contact.surface_velocity = rate_of(
        [&](double after) {
          return surface.query(now.t + after, x + after * sample.velocity).velocity;
        },
        d);
  return contact;
}

double largest_of(const Constraints::Axes& a, int n) {
  double largest = 1e-30;
  for (int i = 0; i < n; ++i) largest = std::max(largest, vector_at(a, i).norm());
  return largest;
}

}  // namespace

ContactAccelerations::ContactAccelerations(Particles& particles, const Constraints& constraints,
                                           int count)
    : particles_(&particles),
      constraints_(&constraints),
      count_(count),
      solver_(constraints),
      a_(Layout(particles.layout().n(), 3).size()) {}

void ContactAccelerations::free(const ParticleView& now, const Constraints::Axes& a) const {
  particles_->accelerate(now, a.data());
  particles_->prescribed().accelerate(now.t, a);
}

bool ContactAccelerations::accelerate(const ParticleView& now, const RowValues& values,
                                      std::span<const RestingContact> resting,
                                      const Evaluation& look, const Constraints::Axes& a) {
  const double largest = largest_of(a, now.n);
  contacts_.clear();
  for (const RestingContact& each : resting) {
    contacts_.push_back(push_of(each, now, look.difference_step, largest));
    contacts_.back().active = each.surplus > 0;  // the active set at the start
    if (!look.has_friction) contacts_.back().friction = 0;
  }
  struct Accelerations final : LinearRows {
    using LinearRows::LinearRows;
    double gap(ContactForce& contact, const Vec3& y) override {
      return contact.normal.dot(y) - contact.min_velocity;
    }
  } problem(values, a, values.bias());
  problem.row_tolerance = problem.gap_tolerance = 1e-15 * largest;
  problem.enough = kGainsNoMore * largest;
  problem.slow = kCreeps * largest;
  if (solver_.solve(contacts_, values.gradient(), a, problem)) return true;
  return std::max(solver_.worst().row, -solver_.worst().gap) <= kAsGood * largest;
}

double ContactAccelerations::surplus(std::size_t k) const {
  const ContactForce& contact = contacts_[k];
  const double weight = constraints_->weights()[static_cast<std::size_t>(contact.particle)];
  return contact.active ? weight * contact.force : -contact.gap;
}

// Finds the resting contacts that do not open.
void ContactAccelerations::find(const ParticleView& now) {
  resting_.clear();
  for (int i = 0; i < count_; ++i) {
    if (!now.free(i)) continue;
    const Vec3 x = now.position(i), v = now.velocity(i);
    for (Collider* const collider : particles_->contacts().all()) {
      const SurfaceSample sample = collider->query(now.t, x);
      if (!(sample.gap <= kContactTolerance * position_scale(x))) continue;
      const Vec3 relative = v - sample.velocity;
      const double fast = v.norm() + sample.velocity.norm(), rate = relative.dot(sample.normal);
      if (rate > kContactTolerance * fast + kContactTolerance) continue;
      const Vec3 slip = relative - rate * sample.normal;
      resting_.push_back({.particle = i,
                          .surface = {collider, sample.normal},
                          .slides = slip.norm() > kContactTolerance * fast + kCreeping});
    }
  }
}

std::span<const double> ContactAccelerations::multipliers(const ParticleView& now,
                                                          const RowValues& values) {
  const auto a = Layout(now.n, 3).axes(a_.data());
  // Sampled surfaces are known up to the present.
  const Evaluation look{.difference_step =
                            particles_->contacts().sampled() ? -kGlanceOfForces : kGlanceOfForces};
  free(now, a);
  find(now);
  if (!accelerate(now, values, resting_, look, a)) {
    free(now, a);
    accelerate(now, values, {}, look, a);
  }
  return solver_.multipliers();
}

}  // namespace sim
