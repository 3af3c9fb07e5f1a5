#include "core/scene/rigid_spec.h"

#include "core/scene/scene_spec.h"

namespace sim {

void place_bodies(SystemSpec& spec) {
  if (spec.bodies.empty()) return;
  if (!spec.particles) spec.particles.emplace();
  for (RigidSpec& each : spec.bodies) {
    each.first = spec.particles->count();
    try {
      const RigidBody body(each.shape, each.mass, each.first);
      RigidState state;
      state.axes = turned_by(each.turn);
      state.center = each.position + state.axes * body.center();
      state.velocity = each.velocity;
      state.spin = each.spin;
      for (int p = 0; p < RigidBody::kParticles; ++p) {
        const Vec3 r = body.corner(state, p);
        spec.particles->list.push_back({state.center + r, state.velocity + state.spin.cross(r),
                                        each.mass / RigidBody::kParticles});
        const ParticleSpec& particle = spec.particles->list.back();
        if (!particle.position.allFinite() || !particle.velocity.allFinite() ||
            !(particle.mass > 0))
          throw Error(ErrorKind::kScene,
                      {"rigid body", "", "its numbers are not finite", "make them smaller"});
      }
    } catch (const Error& error) {
      ErrorText text = error.text();
      text.where = each.place;
      throw Error(error.kind(), text);
    }
  }
}

}  // namespace sim
