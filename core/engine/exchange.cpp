#include "core/engine/exchange.h"

#include "core/base/error.h"

namespace sim::engine {
namespace {

[[noreturn]] void refuse_scene(const std::string& what, const Place& place,
                               const std::string& remedy) {
  throw Error(ErrorKind::kScene,
              {"not for lammps", place, what + " would not mean the same there", remedy});
}

constexpr const char* kLeaveOut = "--without NAME leaves a part out; or run it here";

// A part that is on, of a list that switches may have shortened.
void refuse_first(const std::vector<PartSpec>& parts, const std::vector<std::string>& off,
                  const std::string& kind) {
  for (const PartSpec& part : parts)
    if (part.switch_name.empty() || !std::ranges::binary_search(off, part.switch_name))
      refuse_scene(kind + " '" + part.plugin + "'", part.place, kLeaveOut);
}

Method method_of(const Simulation& system, const Place& place) {
  const std::string& name = system.method().plugin().name;
  const Value* precision = system.method().params().has("precision")
                               ? &system.method().params().value("precision")
                               : nullptr;
  if (precision && to_text(*precision) == "single")
    throw Error(ErrorKind::kUsage, {"not for lammps", place, "its numbers are doubles",
                                    "leave --precision single out"});
  if (name == "verlet") return Method::kVerlet;
  if (name == "symplectic_euler") return Method::kSymplecticEuler;
  throw Error(ErrorKind::kUsage, {"not for lammps", place, "it does not step as " + name + " does",
                                  "lammps takes verlet and symplectic_euler: add -i verlet"});
}

}  // namespace

Exchange::Exchange(Simulation& system, const SystemSpec& spec) : system_(&system) {
  const std::vector<std::string>& off = system.settings().off;
  if (!system.second_order())
    refuse_scene("a first-order state", spec.place, "give a scene of particles");
  particles_ = dynamic_cast<ParticleSystem*>(&system.ode());
  refuse_first(spec.colliders, off, "collider");
  refuse_first(spec.constraints, {}, "constraint");
  for (const LeadSpec& lead : spec.particles->leads)
    refuse_scene("a particle that is led", lead.place, "pin it, or run it here");
  if (!spec.bodies.empty())
    refuse_scene("a rigid body", spec.bodies.front().place, "leave bodies out, or run it here");
  if (spec.contact) refuse_scene("sim.contact", spec.contact->place, "leave contact out");
  for (const Force* force : particles_->other_forces()) {
    const std::string force_name = particles_->name_of(*force);
    Place place = spec.place;
    for (const PartSpec& part : spec.forces)
      if (part.plugin == force_name) place = part.place;
    if (force->springs())
      refuse_scene("the damping of springs", place, "leave damping out, or run it here");
    refuse_scene("force '" + force_name + "'", place, kLeaveOut);
  }
  for (const Force* force : particles_->forces())
    if (force->memory_size() > 0)
      refuse_scene("force '" + particles_->name_of(*force) + "'", spec.place, kLeaveOut);
  method_ = method_of(system, spec.place);
}

Vec3 Exchange::gravity() const {
  const double* const g = particles_->motion().gravity;
  return {g[0], g[1], g[2]};
}

Array Exchange::accelerations() const {
  const Layout layout(particles(), 3);
  Array sums(layout.size());
  const auto [x, y, z] = layout.axes(sums.data());
  double* const a[3] = {x, y, z};
  particles_->accelerate(view(), a, false);
  return sums;
}

}  // namespace sim::engine
