// The momentum and angular momentum that contact must conserve.
#pragma once

#include "core/scene/simulation.h"

namespace sim_test {

struct Momentum {
  sim::Vec3 linear{0, 0, 0}, angular{0, 0, 0};  // kg m/s; kg m^2/s about the origin
};

// The momentum of all bodies and of the single particles, which come first and have this mass each.
inline Momentum momentum_of(const sim::Simulation& system, double mass = 0) {
  Momentum sum;
  for (int i = 0; i < system.body(0).first(); ++i) {
    const sim::Vec3 p = mass * system.velocity(i);
    sum.linear += p;
    sum.angular += system.position(i).cross(p);
  }
  for (int i = 0; i < system.bodies(); ++i) {
    const sim::RigidBody& body = system.body(i);
    const sim::RigidState state = system.body_state(i);
    const sim::Vec3 p = body.mass() * state.velocity;
    sum.linear += p;
    sum.angular += state.center.cross(p) + body.inertia(state) * state.angular_velocity;
  }
  return sum;
}

}  // namespace sim_test
