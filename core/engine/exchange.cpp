#include "core/engine/exchange.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/particles/particle_system.h"

namespace sim::engine {
namespace {

constexpr const char* kLeaveOut = "--without NAME leaves a part out; or run it here";

// Throws refusals in the name of an engine.
class Border {
 public:
  explicit Border(const std::string& engine) : engine_(engine) {}

  [[noreturn]] void scene(const std::string& what, const SourceLocation& place,
                          const std::string& remedy) const {
    throw Error(ErrorKind::kScene,
                {"not for " + engine_, place, what + " would not mean the same there", remedy});
  }
  [[noreturn]] void method(const std::string& why, const SourceLocation& place,
                           const std::string& remedy) const {
    throw Error(ErrorKind::kUsage, {"not for " + engine_, place, why, remedy});
  }
  // A part that is on, of a list that switches may have shortened.
  void first(const std::vector<PartSpec>& parts, const std::vector<std::string>& off,
             const std::string& kind) const {
    for (const PartSpec& part : parts)
      if (part.switch_name.empty() || !std::ranges::binary_search(off, part.switch_name))
        scene(kind + " '" + part.plugin + "'", part.place, kLeaveOut);
  }

 private:
  std::string engine_;
};

Method method_of(const Simulation& system, const SourceLocation& place, const Border& border,
                 const std::string& engine, std::span<const EngineMethod> methods) {
  const Params& params = system.method().params();
  if (params.has("precision") && to_text(params.value("precision")) == "single")
    border.method("its numbers are doubles", place, "leave --precision single out");
  constexpr std::int64_t kOneStep = 1;
  if (params.has("newton_steps") && params.integer("newton_steps") == kOneStep)
    border.method("it solves the equations of a step", place, "leave newton_steps out");
  const std::string& name = system.method().plugin().name;
  std::vector<std::string> known;
  for (const EngineMethod& each : methods) {
    if (each.name == name) return each.method;
    known.emplace_back(each.name);
  }
  const std::string last = known.back();
  known.pop_back();
  border.method(
      "it does not step as " + name + " does", place,
      engine + " takes " + join(known, ", ") + " and " + last + ": add -i " + methods.front().name);
}

}  // namespace

ParticleView Exchange::view() const {
  return particles_->view(system_->t(), system_->state().data());
}

double Exchange::drag() const { return particles_->motion().damping; }
std::span<const SpringRun* const> Exchange::runs() const { return particles_->runs(); }
std::span<const Net* const> Exchange::nets() const { return particles_->nets(); }

Exchange::Exchange(Simulation& system, const SystemSpec& spec, const std::string& engine,
                   std::span<const EngineMethod> methods)
    : system_(&system) {
  const Border border(engine);
  const std::vector<std::string>& off = system.settings().off;
  if (!system.second_order())
    border.scene("the first-order state of '" + system.name() + "'", spec.place,
                 "give a scene of particles");
  particles_ = dynamic_cast<ParticleSystem*>(&system.ode());
  border.first(spec.colliders, off, "collider");
  border.first(spec.constraints, {}, "constraint");
  for (const PrescribedSpec& lead : spec.particles->prescribed)
    border.scene("a prescribed particle", lead.place, "pin it, or run it here");
  if (!spec.bodies.empty())
    border.scene("a rigid body", spec.bodies.front().place, "leave bodies out, or run it here");
  if (spec.contact) border.scene("sim.contact", spec.contact->place, "leave contact out");
  for (const Force* force : particles_->other_forces()) {
    const std::string force_name = particles_->name_of(*force);
    SourceLocation place = spec.place;
    for (const PartSpec& part : spec.forces)
      if (part.plugin == force_name) place = part.place;
    if (force->springs())
      border.scene("the damping of springs", place, "leave damping out, or run it here");
    border.scene("force '" + force_name + "'", place, kLeaveOut);
  }
  for (const Force* force : particles_->forces())
    if (force->springs() && force->springs()->sense() != SpringSense::kBoth)
      border.scene("a cable, as '" + particles_->name_of(*force) + "' is,", spec.place, kLeaveOut);
  for (Force* const force : particles_->forces())
    if (force->breakable())
      border.scene("force '" + particles_->name_of(*force) + "' with ties that may break",
                   spec.place, "leave out break_strain and break_force, or run it here");
  for (const Force* force : particles_->forces())
    if (force->internal_size() > 0)
      border.scene("force '" + particles_->name_of(*force) + "'", spec.place, kLeaveOut);
  method_ = method_of(system, spec.place, border, engine, methods);
  const Params& params = system.method().params();
  if (params.has("tol")) tolerance_ = params.number("tol");
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
