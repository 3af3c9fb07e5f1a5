#include "core/scene/rigid_spec.h"

#include "core/scene/at_source.h"
#include "core/scene/scene_spec.h"

namespace sim {
namespace {

void add_particles(const RigidSpec& spec, std::vector<ParticleSpec>& list) {
  const RigidBody body(spec.shape, spec.mass, spec.first);
  RigidState state;
  state.axes = turned_by(spec.rotation);
  state.center = spec.position + state.axes * body.center();
  state.velocity = spec.velocity;
  state.angular_velocity = spec.angular_velocity;
  for (int p = 0; p < RigidBody::kParticles; ++p) {
    const Vec3 r = body.corner(state, p);
    const ParticleSpec& particle = list.emplace_back(
        ParticleSpec{state.center + r, state.velocity + state.angular_velocity.cross(r),
                     spec.mass / RigidBody::kParticles});
    if (!particle.position.allFinite() || !particle.velocity.allFinite() || !(particle.mass > 0))
      throw Error(ErrorKind::kScene,
                  {"rigid body", "", "its numbers are not finite", "make them smaller"});
  }
}

}  // namespace

void place_bodies(SystemSpec& spec) {
  if (spec.bodies.empty()) return;
  if (!spec.particles) spec.particles.emplace();
  for (RigidSpec& each : spec.bodies) {
    each.first = spec.particles->count();
    at_source(each.place, [&] { add_particles(each, spec.particles->list); });
  }
}

}  // namespace sim
