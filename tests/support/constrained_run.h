// Runs of particles on rods that meet colliders, which look at each state.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "core/particles/constraints/constraint_system.h"
#include "core/particles/particle_system.h"
#include "tests/lua/scene_text.h"
#include "tests/support/constrained_scenes.h"
#include "tests/support/scenes.h"

namespace sim::test {

struct HeldRun : TextRun {
  using TextRun::TextRun;

  std::vector<ConstraintForce> forces() const {
    return system.constraint_system()->forces(system.t(), system.state().data());
  }
  // Steps to t, and looks at each state: on the rods, and outside.
  // Dense output may be inside by what the method is off.
  void run_to(double t, double deep = 1e-9) {
    while (system.t() < t - 1e-9) {
      INFO(system.t());
      REQUIRE(system.step());
      const ConstraintDrift drift =
          system.constraint_system()->drift(system.t(), system.state().data());
      REQUIRE(drift.position < 1e-12);
      REQUIRE(drift.velocity < 1e-11);
      REQUIRE(deepest() < deep);
    }
  }
  double deepest() const {
    const auto& particles =
        dynamic_cast<const ParticleSystem&>(const_cast<HeldRun*>(this)->system.ode());
    double most = 0;
    for (int i = 0; i < system.particles(); ++i)
      for (Collider* const collider : particles.contacts().all())
        if (!system.pinned(i))
          most = std::max(most, -collider->query(system.t(), system.position(i)).gap);
    return most;
  }
  double balance(double before) const {
    const ContactWork work = system.contact_work();
    return system.energy().total() + work.lost - work.given - before;
  }
};

// Checks the tensions of a rope at rest over the cylinder. Along the tangent at each particle,
// cos(half a turn) (T - T before) = m g times its slope.
inline void check_tensions(const HeldRun& run, int links) {
  const std::vector<ConstraintForce> forces = run.forces();
  REQUIRE(forces.size() == static_cast<std::size_t>(links));
  const double half = 0.5 * M_PI / links;
  double tension = 0;
  for (int i = links; i >= 1; --i) {
    tension += -2 * kG * std::cos(M_PI * i / links) / std::cos(half);
    INFO(i);
    CHECK(forces[static_cast<std::size_t>(i - 1)].tension == Approx(tension).epsilon(1e-6));
  }
}

// The order of some number of the end, from three step sizes and what it has to be.
template <class Value>
double order_of(const std::string& text, const std::string& method, double dt, double t,
                double exact, const Value& value) {
  double errors[2];
  for (int k = 0; k < 2; ++k) {
    HeldRun run(text, method, k == 0 ? dt : dt / 4);
    run.run_to(t);
    errors[k] = std::fabs(value(run.system) - exact);
  }
  INFO(errors[0] << " " << errors[1]);
  CHECK(errors[0] < 0.05);
  return std::log2(errors[0] / errors[1]) / 2;
}

}  // namespace sim::test
