#include "core/particles/particle_system.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/finite.h"
#include "core/base/text.h"
#include "core/particles/constraints/constrained_contact.h"
#include "core/particles/constraints/constrained_impact_events.h"
#include "core/particles/explicit/embedded_rk_stepper.h"
#include "core/particles/explicit/generic_splitting_stepper.h"
#include "core/particles/explicit/reordering.h"
#include "core/particles/explicit/rk_stepper.h"
#include "core/particles/explicit/splitting_stepper.h"
#include "core/particles/particle_impact_events.h"
#include "core/particles/particle_jacobian.h"

namespace sim {
namespace {

// Throws unless forces and masses are in the range of single precision, with a margin for the
// intermediate results of a step.
void check_single(const ParticleSystem& system) {
  const auto refuse = [](const std::string& why) {
    throw Error(ErrorKind::kScene, {"single precision does not fit", "", why, "use double"});
  };
  if (!system.nets().empty())
    refuse("springs that are not in runs of equal id differences are double precision only");
  if (!system.contacts().empty()) refuse("colliders are double precision only");
  if (system.constraint_system()) refuse("constraints are double precision only");
  if (!system.prescribed().empty()) refuse("leading particles is double precision only");
  for (const Force* force : system.other_forces())
    refuse("force '" + system.name_of(*force) + "' is double precision only");

  constexpr double kLeastSingle = 1e-20, kMostSingle = 1e20;
  const auto check = [&](double value, const std::string& what) {
    const double size = std::fabs(value);
    if (size != 0 && !(size >= kLeastSingle && size <= kMostSingle))
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

[[noreturn]] void refuse(const std::string& why, const std::string& remedy) {
  throw Error(ErrorKind::kScene, {"integrator does not fit", "", why, remedy});
}

// Wraps a stepper that evaluates only the system, and projects the end of each step onto the states
// that constraints and prescribed paths allow.
class ConstrainedStepper final : public Stepper {
 public:
  ConstrainedStepper(ParticleSystem& system, std::unique_ptr<Stepper> stepper)
      : system_(&system), stepper_(std::move(stepper)) {}

  bool step(double t, double h, int count, const double* x, double* x_next) override {
    ConstraintSystem* const constraint_system = system_->constraint_system();
    if (constraint_system) constraint_system->refuse({});
    const bool done = stepper_->step(t, h, count, x, x_next);
    if (!done && constraint_system && !constraint_system->refusal().empty())
      std::copy_n(x, system_->size(), x_next);
    return done && system_->end_step(t + h, x, x_next);
  }
  void restart() override { stepper_->restart(); }

 private:
  ParticleSystem* system_;
  std::unique_ptr<Stepper> stepper_;
};

class ConstrainedEmbeddedStepper final : public EmbeddedStepper {
 public:
  ConstrainedEmbeddedStepper(ParticleSystem& system, std::unique_ptr<EmbeddedStepper> stepper)
      : system_(&system), stepper_(std::move(stepper)) {}

  bool start(double t, const double* x) override { return stepper_->start(t, x); }
  bool step(double t, double h, const double* x, double* x_next) override {
    return stepper_->step(t, h, x, x_next) && system_->end_step(t + h, x, x_next);
  }
  bool close(double t, const double* x) override { return stepper_->close(t, x); }
  void extend(double t, double h, const double* x) override { stepper_->extend(t, h, x); }
  void combine(const double* x, double h, std::span<const double> weights, const double* base,
               double* out) override {
    stepper_->combine(x, h, weights, base, out);
  }
  void shift() override { stepper_->shift(); }

 private:
  ParticleSystem* system_;
  std::unique_ptr<EmbeddedStepper> stepper_;
};

// Rewrites a plan so that each drift lies between two kicks, as SHAKE and RATTLE and their
// compositions need it. Three leapfrog steps that begin with drifts become three that begin with
// kicks.
SplitPlan begun_with_kicks(const SplitPlan& plan) {
  if (plan.drift.front() == 0) return plan;
  SplitPlan other = plan;
  other.drift = {0};
  other.drift.insert(other.drift.end(), plan.kick.begin(), plan.kick.end());
  other.drift.push_back(0);
  other.kick = plan.drift;
  return other;
}

bool composed_of_leapfrogs(const SplitPlan& plan) {
  double last = 0;
  for (std::size_t i = 0; i < plan.kick.size(); ++i) {
    if (std::fabs(plan.drift[i] - 0.5 * (last + plan.kick[i])) > 1e-12) return false;
    last = plan.kick[i];
  }
  return std::fabs(plan.drift.back() - 0.5 * last) <= 1e-12;
}

}  // namespace

ParticleSystem::ParticleSystem(const std::vector<double>& masses, const std::vector<int>& pinned,
                               std::vector<std::unique_ptr<Force>> forces, const double* initial,
                               ThreadPool& pool)
    : Particles(masses, pinned, std::move(forces), initial, pool) {}

ParticleSystem::~ParticleSystem() = default;

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
  for (const InternalVariables& memory : internal_variables()) {
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
  static const RowList kNone;
  const RowList& rows = constraint_system_ ? constraint_system_->constraints().rows() : kNone;
  for (const RowList::Part& curve : rows.parts)
    if (curve.internal_size > 0)
      parts.push_back(
          {.name = "place of particle " +
                   std::to_string(rows.pattern.ids[static_cast<std::size_t>(curve.entry)]) +
                   " on '" + constraint_system_->constraints().title(curve) + "'",
           .item = "place",
           .components = {"s"},
           .count = curve.internal_size,
           .begin = constraint_system_->internal_begin() + curve.memory});
  return {size(), std::move(parts)};
}

std::string ParticleSystem::refusal() const {
  const int i = contacts().empty() ? -1 : contacts().work_sums().over_constrained();
  if (i < 0) return constraint_system_ ? constraint_system_->refusal() : std::string();
  return "particle " + std::to_string(i) + " is squeezed between colliders and has no room left";
}

std::vector<std::string> ParticleSystem::notes() const {
  std::vector<std::string> all = notes_;
  all.insert(all.end(), contacts().notes().begin(), contacts().notes().end());
  if (constraint_system_)
    all.insert(all.end(), constraint_system_->notes().begin(), constraint_system_->notes().end());
  return all;
}

ConstraintSystem& ParticleSystem::add_constraint_system() {
  if (!constraint_system_) constraint_system_ = std::make_unique<ConstraintSystem>(*this);
  return *constraint_system_;
}

void ParticleSystem::set_masses(const std::vector<double>& masses, const std::vector<int>& pinned,
                                bool some_move) {
  Particles::set_masses(masses, pinned, some_move);
  if (constraint_system_) constraint_system_->begin();
  if (constrained_events_) constrained_events_->restart();
}

void ParticleSystem::refresh_constraints() {
  constraint_system_->refresh();
  if (constrained_events_) constrained_events_->restart();
}

bool ParticleSystem::project(double t, double* x) {
  prescribed().place(t, layout().axes(x), layout().axes(x, 3));
  return !constraint_system_ || constraint_system_->constraints().feedback() > 0 ||
         constraint_system_->project_state(t, x, false);
}

const double* ParticleSystem::begin_step(double t, double h, const double* x, bool again) {
  StageContact* const contact = stage_contact();
  return contact ? contact->begin(t, h, x, again) : x;
}

StepEnd ParticleSystem::end_step(double t, double h, const double* x, double* x_next) {
  const StepEnd end = OdeSystem::end_step(t, h, x, x_next);
  StageContact* const contact = stage_contact();
  if (!contact || end != StepEnd::kAccepted) return end;
  return contact->end(x_next, !(events_ && events_->begun()));
}

Events* ParticleSystem::events() {
  if (contacts().empty()) return nullptr;
  if (constraint_system_)
    return constraint_system_->joins_contact() ? &constrained_events() : nullptr;
  return &impact_events();
}

ParticleImpactEvents& ParticleSystem::impact_events() {
  if (!events_) events_ = std::make_unique<ParticleImpactEvents>(*this);
  return *events_;
}

ConstrainedImpactEvents& ParticleSystem::constrained_events() {
  if (!constrained_events_)
    constrained_events_ = std::make_unique<ConstrainedImpactEvents>(*this, *constraint_system_);
  return *constrained_events_;
}

void ParticleSystem::forget_events() {
  if (events_) events_->forget();
  if (constrained_events_) constrained_events_->forget();
}

bool ParticleSystem::had_impact() const {
  const StageContact* const contact = stage_contact();
  return contact && contact->had_impact();
}

// A step without an allowed end state keeps its numbers finite, so that refusal() is reported.
bool ParticleSystem::end_step(double t, const double* x, double* x_next) {
  prescribed().place(t, layout().axes(x_next), layout().axes(x_next, 3));
  if (!constraint_system_) return true;
  constraint_system_->refuse({});
  if (constraint_system_->constraints().feedback() > 0) return true;
  const bool near = !(constrained_events_ && constrained_events_->begun());
  if (constraint_system_->project_state(t, x_next, near)) return true;
  if (all_finite({x_next, size()})) std::copy_n(x, size(), x_next);
  return false;
}

void ParticleSystem::combine(const Stage& stage, double* out) {
  for_ranges(6,
             [&](std::size_t begin, std::size_t end) { combine_range_(stage, out, begin, end); });
  if (size() > layout().size()) combine_range_(stage, out, layout().size(), size());
}

void ParticleSystem::eval(double t, const Stage& stage, double* y, double* dydt) {
  combine(stage, y);
  double* const a[3] = {layout().block(dydt, 3), layout().block(dydt, 4), layout().block(dydt, 5)};
  accelerate(view(t, y), a);
  prescribed().accelerate(t, {a[0], a[1], a[2]});
  if (const StageContact* const contact = stage_contact()) contact->accelerate(view(t, y), a);
  if (events_) events_->accelerate(view(t, y), a);
  if (constraint_system_) {
    const bool lies = constrained_events_ && constrained_events_->has_contact_forces_at(t);
    const double* const memory = y + constraint_system_->internal_begin();
    const bool held = lies ? constrained_events_->add_constraint_forces(view(t, y), memory, a)
                           : constraint_system_->add_constraint_forces(view(t, y), memory, a);
    if (!held) a[0][0] = std::nan("");
    std::fill_n(dydt + constraint_system_->internal_begin(), constraint_system_->internal_size(),
                0.0);
  }
  derive(view(t, y), dydt + layout().size());
  for (int axis = 0; axis < 3; ++axis)
    std::copy_n(layout().block(y, 3 + axis), layout().n(), layout().block(dydt, axis));
}

bool ParticleSystem::has_large_nets() const {
  return std::ranges::any_of(nets(), [](const Net* net) { return net->reordered(); });
}

void ParticleSystem::order_by(const ParticleView& initial) {
  if (has_large_nets()) rows_ = Reordering::rows_of(initial);
}

const std::shared_ptr<const Reordering>& ParticleSystem::reordering() {
  const bool plain =
      other_forces().empty() && contacts().empty() && is_plain() && !constraint_system_;
  if (rows_.empty() || !plain || !has_large_nets())
    reordering_.reset();
  else if (!reordering_ || !reordering_->fits(*this))
    reordering_ = std::make_shared<const Reordering>(*this, rows_);
  return reordering_;
}

void ParticleSystem::require_accuracy() const {
  if (constraint_system_ && constraint_system_->joins_contact() &&
      contacts().accuracy() == Accuracy::kProject)
    throw Error(ErrorKind::kScene,
                {"accuracy does not fit", "", "this scene has colliders and constraints",
                 "use \"settle\" or \"event\""});
}

// Adds contact to a stepper for scenes that have both constraints and colliders.
std::unique_ptr<Stepper> ParticleSystem::touching(std::unique_ptr<Stepper> stepper,
                                                  bool first_order) {
  if (!constraint_system_->joins_contact()) return stepper;
  require_accuracy();
  if (contacts().accuracy() == Accuracy::kEvent) return stepper;
  return std::make_unique<ConstrainedContactStepper>(*this, *constraint_system_, std::move(stepper),
                                                     first_order);
}

// Forces with internal variables and prescribed particles need the steppers for general systems.
std::unique_ptr<Stepper> ParticleSystem::explicit_stepper(const ExplicitPlan& plan) {
  forget_events();
  if (plan.precision == Precision::kSingle) {
    check_single(*this);
    return std::make_unique<RkStepper<float>>(*this, plan);
  }
  if (constraint_system_)
    return touching(std::make_unique<ConstrainedStepper>(*this, OdeSystem::explicit_stepper(plan)),
                    plan.stages == 1);
  if (const auto& numbering = reordering())
    return std::make_unique<ReorderedStepper>(*this, numbering, [&](Particles& particles) {
      return std::make_unique<RkStepper<double>>(particles, plan);
    });
  const bool cuts = !contacts().empty() && contacts().accuracy() == Accuracy::kEvent;
  if (is_plain() && !cuts) return std::make_unique<RkStepper<double>>(*this, plan);
  auto stepper = OdeSystem::explicit_stepper(plan);
  if (!prescribed().empty())
    stepper = std::make_unique<ConstrainedStepper>(*this, std::move(stepper));
  if (!has_inequalities() || cuts) return stepper;
  return std::make_unique<ContactStepper>(*this, std::move(stepper), plan.stages == 1);
}

std::unique_ptr<EmbeddedStepper> ParticleSystem::embedded_stepper(const EmbeddedPlan& plan) {
  forget_events();
  require_accuracy();
  if (constraint_system_ || !prescribed().empty())
    return std::make_unique<ConstrainedEmbeddedStepper>(*this, OdeSystem::embedded_stepper(plan));
  if (!is_plain() || has_inequalities()) return OdeSystem::embedded_stepper(plan);
  return std::make_unique<EmbeddedRkStepper>(*this, plan);
}

std::unique_ptr<Stepper> ParticleSystem::split_stepper(const SplitPlan& plan) {
  forget_events();
  if ((needs_velocities() && plan.order > 2) || internal_follows_particles()) return nullptr;
  if (plan.precision == Precision::kSingle) {
    check_single(*this);
    return std::make_unique<SplittingStepper<float>>(*this, plan);
  }
  if (constraint_system_) {
    if (plan.drift.front() != 0 && !composed_of_leapfrogs(plan))
      refuse(
          "this scene has constraints, and this method splits its steps in another way than into "
          "leapfrog steps",
          "use verlet, yoshida4, rk4 or an adaptive method");
    if (constraint_system_->joins_contact() && contacts().accuracy() == Accuracy::kEvent)
      refuse(
          "this scene has colliders, and constraints, and a splitting method has no part for what "
          "lies on surfaces",
          "use rk4 or accuracy = \"settle\"");
    return touching(std::make_unique<GenericSplittingStepper>(*this, begun_with_kicks(plan),
                                                              constraint_system_.get()),
                    plan.order == 1);
  }
  if (!is_plain()) return std::make_unique<GenericSplittingStepper>(*this, plan);
  if (const auto& numbering = reordering())
    return std::make_unique<ReorderedStepper>(*this, numbering, [&](Particles& particles) {
      return std::make_unique<SplittingStepper<double>>(particles, plan);
    });
  return std::make_unique<SplittingStepper<double>>(*this, plan);
}

ImplicitSolvers& ParticleSystem::solvers() {
  if (!solvers_ && !make_solvers_)
    refuse("it is implicit, and this program has nothing that solves its equations",
           "open the plugin solvers/particles, or use rk4");
  if (!solvers_) solvers_ = make_solvers_(*this);
  return *solvers_;
}

std::unique_ptr<StageSolver> ParticleSystem::stage_solver(const StageOptions& options) {
  forget_events();
  return solvers().stage_solver(options);
}

std::unique_ptr<ImplicitExplicitStepper> ParticleSystem::implicit_explicit_stepper(
    const ImplicitExplicitPlan& plan) {
  forget_events();
  return solvers().implicit_explicit_stepper(plan);
}

std::optional<bool> ParticleSystem::stiff(const Force& force) const {
  for (const auto& [of, stiff] : stiff_)
    if (of == &force) return stiff;
  return {};
}

std::unique_ptr<Jacobian> ParticleSystem::jacobian() {
  if (internal_size() > 0 || constraint_system_) return OdeSystem::jacobian();
  return std::make_unique<ParticleJacobian>(*this);
}

}  // namespace sim
