// Contact of unconstrained particles as events.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/array.h"
#include "core/particles/impact_events.h"
#include "core/particles/resting_contact.h"

namespace sim {

// Contact of unconstrained particles (RestingContactForce). If a method does not evaluate f for
// that, resting contacts act from the start of the step, as in other methods.
class ParticleImpactEvents final : public ImpactEvents {
 public:
  explicit ParticleImpactEvents(Particles& particles);

  void begin(double t, double h, const double* x) override;
  double first(double t, double h, const double* x, const double* x_next) override;
  Outcome end(double t, double h, const double* x, double* x_next, bool cut) override;

  // True if f has resting contacts at a time within the step; for callers that evaluate f without
  // accelerations.
  bool holds_at(double t) {
    in_forces_ = in_forces_ || within(t);
    return within(t) && !held_.empty();
  }
  // a: free accelerations at a time within the step; those of resting particles become the
  // constrained ones.
  void accelerate(const ParticleView& view, double* const a[3]);

 private:
  struct Held {
    int particle = 0, count = 0;
    SupportSurface surface[3] = {};
    double leaving = 0;      // m/s, the largest normal velocity away from one of them
    double surplus = 0;      // m/s^2, at the start
    double squeeze = 0;      // m/s^2, at the start
    Vec3 slip{0, 0, 0};      // m/s, at the start
    bool sticks = false;     // from the start on, so that its slip is rounding
    ContactWork power = {};  // W/kg, at the start
    std::span<const SupportSurface> all() const {
      return {surface, static_cast<std::size_t>(count)};
    }
  };

  void find_held(const double* x);
  RestingContactForce look_at(const Held& held, const ParticleView& view, const Vec3& free) const;
  void evaluate(double t, const double* x);  // free accelerations, into accelerations_
  Vec3 free_of(int i) const;                 // of them
  double edge_of(const Held& held, double h, const ParticleView& before,
                 const ParticleView& after) const;
  void put_back(double t, double h, const double* x, double* x_next);
  bool press(double t, double h, const double* x, double* x_next, bool all);
  bool bounce(double t, double* x);
  template <class Body>
  void for_near(double t, double h, const double* x, const double* x_next, const Body& body);

  std::vector<Held> held_;
  std::vector<std::uint8_t> is_held_;
  Array accelerations_;
};

}  // namespace sim
