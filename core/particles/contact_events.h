// Touches of particles with colliders as events, at which methods end their steps.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/ode/ode_system.h"
#include "core/particles/particles.h"
#include "core/particles/pressed.h"

namespace sim {

// A step ends where a particle that was free touches a collider, where one that lies on a surface
// is no longer pressed to it, and where its slip turns. In between what lies on a surface has an
// acceleration that leads into none (Pressed), so that f is smooth and a method has its own order;
// at the end of a step it is put back on the surface (Hairer, Lubich & Wanner 2006, section IV.4).
// Methods that do not evaluate f for that have it pressed on from the start of the step, as others.
class ContactEvents final : public Events {
 public:
  explicit ContactEvents(Particles& particles);

  void begin(double t, double h, const double* x) override;
  double first(double t, double h, const double* x, const double* x_next) override;
  Outcome end(double t, double h, const double* x, double* x_next, bool cut) override;
  void gave_up() override { particles_->contacts().ledger().count_uncut(); }
  void repeated() override;

  bool begun() const noexcept { return begun_; }  // by the present method
  void forget() noexcept {                        // another method comes
    begun_ = false;
    span_ = {};
  }

  // A method with steps of its own may be beyond the state that it shows. Work counts as far as
  // shown: what acts all along a step by its share, what happens at its end when that is shown.
  void show(double t);                           // the time of the present state
  ContactWork take(double t);                    // J since then, and shows t
  void forget_ahead() { span_ = {.on = true}; }  // another course comes
  // a: free accelerations at a time within the step; those of what is held become what they are.
  void accelerate(const ParticleView& view, double* const a[3]);

 private:
  struct Held {
    int particle = 0, count = 0;
    Collider* collider[3] = {};
    double surplus = 0;      // m/s^2, at the start
    Vec3 slip{0, 0, 0};      // m/s, at the start
    ContactWork power = {};  // W/kg, at the start
    std::span<Collider* const> all() const { return {collider, static_cast<std::size_t>(count)}; }
  };

  void find_held(const double* x);
  Pressed look_at(const Held& held, const ParticleView& view, const Vec3& free) const;
  void evaluate(double t, const double* x);  // free accelerations, into accelerations_
  Vec3 free_of(int i) const;                 // of them
  void put_back(double t, double h, double* x);
  bool press(double t, double h, const double* x, double* x_next, bool all);
  bool bounce(double t, double* x);
  template <class Body>
  void for_near(double t, double h, const double* x, const double* x_next, const Body& body);

  // The present step, and what was not shown of those before it.
  struct Span {
    bool on = false;
    double from = 0, length = 0, shown = 0;  // s
    ContactWork passed = {}, along = {}, at_end = {};
    ContactWork steady = {};  // of `along`, what there were if the power stayed that of the start
    double share(double t) const;
    void add_along(ContactWork& sum, double begin, double end) const;  // between two shares
  };
  void begin_span(double t, double h);

  Particles* particles_;
  Span span_;
  double t_ = 0, h_ = 0;
  bool begun_ = false, in_forces_ = false;
  std::vector<Held> held_;
  std::vector<std::uint8_t> is_held_;
  Array accelerations_;
};

}  // namespace sim
