// Touches of particles with colliders as events, at which methods end their steps.
#pragma once

#include "core/ode/ode_system.h"
#include "core/particles/particles.h"
#include "core/particles/shown_work.h"

namespace sim {

// A step ends where a particle that was free touches a collider, where one that lies on a surface
// is no longer pressed to it, and where its slip turns. In between what lies on a surface has an
// acceleration that leads into none, so that f is smooth and a method has its own order; at the end
// of a step it is put back on the surface (Hairer, Lubich & Wanner 2006, section IV.4).
class TouchEvents : public Events {
 public:
  explicit TouchEvents(Particles& particles)
      : particles_(&particles), shown_(particles.contacts().ledger()) {}

  void gave_up() override { particles_->contacts().ledger().count_uncut(); }
  void repeated() override { shown_.repeated(); }

  bool begun() const noexcept { return begun_; }  // by the present method
  void forget() noexcept {                        // another method comes
    begun_ = false;
    shown_.forget();
  }
  ShownWork& shown() { return shown_; }

 protected:
  static constexpr double kOn = 1e-9;     // m in units of the place: a gap that counts as none
  static constexpr double kIn = 1e-11;    // likewise, and less than none, at an end
  static constexpr double kStill = 1e-9;  // of velocities: a rate of the gap that counts as none
  static constexpr double kLeastShare = 1e-9;  // shares of a step that are none
  static constexpr double kPressed = 1e-7;     // of the acceleration: a push that is none

  // Where in a step the first event is, as a share of it.
  struct Earliest {
    double s = 1;
    void may_be(double other) {
      if (other > kLeastShare && other < s && other < 1 - kLeastShare) s = other;
    }
  };

  void begin_step(double t, double h) {
    t_ = t;
    h_ = h;
    begun_ = true;
    in_forces_ = false;
    const Contacts& contacts = particles_->contacts();
    contacts.ledger().begin_step();
    if (contacts.sampled()) contacts.look(t, t + h);
  }
  bool within(double t) const { return begun_ && t >= t_ && t <= t_ + h_; }
  Outcome outcome(bool jumped) const {
    if (particles_->contacts().ledger().squeezed() >= 0) return Outcome::kNotAllowed;
    return jumped ? Outcome::kJumped : Outcome::kSmooth;
  }

  Particles* particles_;
  ShownWork shown_;
  double t_ = 0, h_ = 0;
  bool begun_ = false, in_forces_ = false;  // f was asked for what is held
};

}  // namespace sim
