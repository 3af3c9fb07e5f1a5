#include "core/particles/particle_system.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/particles/explicit/embedded_rk_stepper.h"
#include "core/particles/explicit/plain_split_stepper.h"
#include "core/particles/explicit/rk_stepper.h"
#include "core/particles/explicit/split_stepper.h"
#include "core/particles/implicit/local_global_solver.h"
#include "core/particles/implicit/memory_first.h"
#include "core/particles/implicit/newton_solver.h"
#include "core/particles/implicit/particle_jacobian.h"

namespace sim {
namespace {

// Throws unless the forces and masses can be had in single precision, with room for what a step
// makes of them.
void check_single(const ParticleSystem& system) {
  const auto refuse = [](const std::string& why) {
    throw Error(ErrorKind::kScene, {"single precision does not fit", "", why, "use double"});
  };
  if (!system.nets().empty())
    refuse("springs that are not in runs of equal id differences are double precision only");
  if (system.confined()) refuse("colliders are double precision only");
  for (const Force* force : system.other_forces())
    refuse("force '" + system.name_of(*force) + "' is double precision only");

  constexpr double kLeast = 1e-20, kMost = 1e20;
  const auto check = [&](double value, const std::string& what) {
    const double size = std::fabs(value);
    if (size != 0 && !(size >= kLeast && size <= kMost))
      refuse(what + " of " + shortest(value) + " is not between 1e-20 and 1e20");
  };
  const Motion& motion = system.motion();
  for (const double g : motion.gravity) check(g, "an acceleration");
  check(motion.damping, "a drag");
  for (const double mass : system.masses())
    if (std::isfinite(mass)) check(mass, "a mass");
  for (const SpringRun* run : system.runs())
    for (int a = 0; a + run->stride < system.layout().n(); ++a) {
      if (!run->owns(a)) continue;
      check(run->k_of(a), "a stiffness");
      check(run->k_of(a) * run->rest_of(a), "stiffness times rest length");
      if (run->uniform) break;
    }
}

[[noreturn]] void refuse_contact(const std::string& why) {
  throw Error(ErrorKind::kScene,
              {"integrator does not fit", "", "this scene has colliders, and " + why,
               "use rk4, verlet or another explicit method of fixed steps, or contact as a "
               "force: sim.force.contact { collider = ..., stiffness = ... }"});
}

}  // namespace

StateShape ParticleSystem::shape() const {
  const auto part = [&](const char* name, std::vector<std::string> components, int block) {
    return StatePart{.name = name,
                     .item = "particle",
                     .components = std::move(components),
                     .count = static_cast<std::size_t>(layout().n()),
                     .begin = layout().offset(block),
                     .component_stride = layout().offset(1) - layout().offset(0)};
  };
  std::vector<StatePart> parts{part("position", {"x", "y", "z"}, 0),
                               part("velocity", {"vx", "vy", "vz"}, 3)};
  for (const ForceMemory& memory : memories()) {
    std::string name = "memory of '" + name_of(*memory.force) + "'";
    const auto before = std::ranges::count_if(
        parts, [&](const StatePart& earlier) { return earlier.name.starts_with(name); });
    if (before > 0) name += " " + std::to_string(before + 1);
    parts.push_back({.name = name,
                     .item = name,
                     .components = {"memory"},
                     .count = memory.size,
                     .begin = layout().size() + memory.begin});
  }
  return {size(), std::move(parts)};
}

std::string ParticleSystem::refusal() const {
  const int i = contacts().empty() ? -1 : contacts().ledger().squeezed();
  if (i < 0) return {};
  return "particle " + std::to_string(i) + " is squeezed between colliders and has no room left";
}

void ParticleSystem::combine(const Stage& stage, double* out) {
  for_ranges(6,
             [&](std::size_t begin, std::size_t end) { combine_range_(stage, out, begin, end); });
  if (memory_size() > 0) combine_range_(stage, out, layout().size(), size());
}

void ParticleSystem::eval(double t, const Stage& stage, double* y, double* dydt) {
  combine(stage, y);
  double* const a[3] = {layout().block(dydt, 3), layout().block(dydt, 4), layout().block(dydt, 5)};
  accelerate(view(t, y), a);
  derive(view(t, y), dydt + layout().size());
  for (int axis = 0; axis < 3; ++axis)
    std::copy_n(layout().block(y, 3 + axis), layout().n(), layout().block(dydt, axis));
}

// Forces with a memory have steppers for systems of any kind.
std::unique_ptr<Stepper> ParticleSystem::explicit_stepper(const ExplicitPlan& plan) {
  if (plan.precision == Precision::kSingle) {
    check_single(*this);
    return std::make_unique<RkStepper<float>>(*this, plan);
  }
  if (memory_size() == 0) return std::make_unique<RkStepper<double>>(*this, plan);
  auto stepper = OdeSystem::explicit_stepper(plan);
  if (!confined()) return stepper;
  return std::make_unique<SettledStepper>(*this, std::move(stepper));
}

std::unique_ptr<EmbeddedStepper> ParticleSystem::embedded_stepper(const EmbeddedPlan& plan) {
  if (confined()) refuse_contact("an adaptive method does not end its steps at a touch");
  if (memory_size() > 0) return OdeSystem::embedded_stepper(plan);
  return std::make_unique<EmbeddedRkStepper>(*this, plan);
}

std::unique_ptr<Stepper> ParticleSystem::split_stepper(const SplitPlan& plan) {
  if ((needs_velocities() && plan.order > 2) || memories_follow_particles()) return nullptr;
  if (plan.precision == Precision::kSingle) {
    check_single(*this);
    return std::make_unique<SplitStepper<float>>(*this, plan);
  }
  if (memory_size() > 0) return std::make_unique<PlainSplitStepper>(*this, plan);
  return std::make_unique<SplitStepper<double>>(*this, plan);
}

std::unique_ptr<StageSolver> ParticleSystem::stage_solver(const StageOptions& options) {
  if (confined()) refuse_contact("an implicit method does not know of contact in its equations");
  const auto asked = [this] { return stopped(); };
  if (options.method == StageOptions::Method::kLocalGlobal)
    return std::make_unique<LocalGlobalSolver>(*this, options, asked);
  if (memories_follow_particles()) return OdeSystem::stage_solver(options);
  auto solver = std::make_unique<NewtonSolver>(*this, options, asked);
  if (memory_size() == 0) return solver;
  return std::make_unique<MemoryFirst>(*this, std::move(solver), options);
}

std::unique_ptr<Jacobian> ParticleSystem::jacobian() {
  if (memory_size() > 0) return OdeSystem::jacobian();
  return std::make_unique<ParticleJacobian>(*this);
}

}  // namespace sim
