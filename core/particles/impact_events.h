// Impacts of particles on colliders as events, at which methods end their steps.
#pragma once

#include "core/ode/ode_system.h"
#include "core/particles/particles.h"
#include "core/particles/reported_contact_work.h"
#include "core/particles/step_path.h"

namespace sim {

// A step ends at the impact of a free particle with a collider, where a resting contact opens, and
// where its slip reverses, or leads over an edge. In between resting particles have constrained
// accelerations, so that f is smooth and a method keeps its order; at the end of a step they are
// projected back onto the surface (Hairer, Lubich & Wanner 2006, section IV.4).
class ImpactEvents : public Events {
 public:
  explicit ImpactEvents(Particles& particles)
      : particles_(&particles), reported_work_(particles.contacts().work_sums()) {}

  void gave_up() override { particles_->contacts().work_sums().count_uncut(); }
  void repeated() override { reported_work_.repeated(); }

  bool begun() const noexcept { return begun_; }  // by the present method
  void forget() noexcept {                        // another method comes
    begun_ = false;
    reported_work_.forget();
  }
  ReportedContactWork& reported_work() { return reported_work_; }

 protected:
  static constexpr double kGapTolerance =
      1e-9;  // m in units of the place: a gap that counts as none
  static constexpr double kPenetrationTolerance = 1e-11;  // likewise, and less than none, at an end
  static constexpr double kVelocityTolerance =
      1e-9;  // of velocities: a rate of the gap that counts as none
  static constexpr double kMinFraction = 1e-9;     // shares of a step that are none
  static constexpr double kForceTolerance = 1e-7;  // of the acceleration: a push that is none

  // The first event in a step, as a share of it.
  struct Earliest {
    double s = 1;
    void may_be(double other) {
      if (other > kMinFraction && other < s && other < 1 - kMinFraction) s = other;
    }
  };

  void begin_step(double t, double h) {
    t_ = t;
    h_ = h;
    begun_ = true;
    in_forces_ = false;
    const Contacts& contacts = particles_->contacts();
    contacts.work_sums().begin_step();
    if (contacts.sampled()) contacts.prepare_interval(t, t + h);
  }
  bool within(double t) const { return begun_ && t >= t_ && t <= t_ + h_; }
  // Where a particle in resting contact slides over an edge of the surface on its path through a
  // step, as a share of the step; 1: nowhere. gained: m/s, by forces in the step.
  double edge_on(const Collider& collider, double h, const StepPath& path, double gained) const;
  // True where an edge is less than a gap that counts as none ahead. sample: at the place.
  static bool is_at_edge(const Collider& collider, double t, const Vec3& place,
                         const Vec3& velocity, const SurfaceSample& sample);
  Outcome outcome(bool had_impact) {
    if (particles_->contacts().work_sums().over_constrained() >= 0) return refused();
    return had_impact ? Outcome::kImpact : Outcome::kSmooth;
  }

  Outcome refused() {
    reported_work_.refused();
    return Outcome::kNotAllowed;
  }

  Particles* particles_;
  ReportedContactWork reported_work_;
  double t_ = 0, h_ = 0;
  bool begun_ = false, in_forces_ = false;  // f was asked for resting contacts
};

}  // namespace sim
