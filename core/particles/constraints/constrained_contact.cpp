#include "core/particles/constraints/constrained_contact.h"

#include <algorithm>
#include <cmath>

#include "core/base/finite.h"

namespace sim {
namespace {

constexpr int kMostCuts = 64;     // of a step
constexpr int kMostHalvings = 3;  // of a substep without a solution
constexpr double kFails = -1;
constexpr double kNoImpact = UnilateralRattle::kNoImpact,
                 kSimultaneous = UnilateralRattle::kSimultaneous;

}  // namespace

ConstrainedContact::ConstrainedContact(Particles& particles, ConstraintSystem& constraint_system,
                                       bool first_order)
    : particles_(&particles),
      constraint_system_(&constraint_system),
      rattle_(particles, constraint_system, first_order),
      start_(constraint_system.internal_begin() + constraint_system.internal_size()) {}

// Computes the state at the end of a substep; false if the stepper fails.
bool ConstrainedContact::advance(Stepper& stepper, const Substep& substep, bool again) {
  if (again) stepper.restart();
  if (substep.r > 0) return stepper.step(substep.t, substep.r, 1, substep.from, substep.to);
  std::copy_n(substep.from, start_.size(), substep.to);
  return true;
}

// Makes one substep up to its first impact; returns the share made, negative if there is no
// solution.
double ConstrainedContact::make(Stepper& stepper, const Substep& substep, bool again,
                                bool may_cut) {
  const Contacts& contacts = particles_->contacts();
  if (!advance(stepper, substep, again)) return kFails;
  rattle_.find_impacts(substep.ends());
  const auto& impacts = rattle_.impacts();
  if (impacts.empty()) return 1;
  touched_ = true;
  // Resting contacts are solved first, for they change the paths of other particles.
  if (std::ranges::any_of(impacts, &Impact::known)) {
    if (!rattle_.solve_substep(substep, -1, false)) return kFails;
    rattle_.find_impacts(substep.ends());
  }
  const bool hits = std::ranges::any_of(impacts, [](const Impact& m) { return !m.known; });
  const double s = may_cut ? rattle_.next_cut() : kNoImpact;
  if (s == kNoImpact && hits) {
    if (std::ranges::any_of(impacts, &Impact::cuts)) contacts.work_sums().count_uncut();
    if (!advance(stepper, substep, true) || !rattle_.solve_substep(substep, 1, false))
      return kFails;
  } else if (s < 1) {
    Substep before = substep;
    before.r = s * substep.r;
    if (!advance(stepper, before, true) || !rattle_.solve_substep(before, s + kSimultaneous, true))
      return kFails;
  }
  if (!all_finite({substep.to, start_.size()})) return kFails;
  rattle_.record_work();
  return s;
}

bool ConstrainedContact::step(Stepper& stepper, double t, double h, const double* x,
                              double* x_next) {
  const Contacts& contacts = particles_->contacts();
  contacts.work_sums().begin_step();
  if (contacts.sampled()) contacts.prepare_interval(t, t + h);
  Substep substep{t, h, x, x_next};
  touched_ = false;
  bool again = rattle_.push_out(t, x, start_.data());
  if (again) substep.from = start_.data();
  int smaller = 0;
  for (int cuts = 0;; ++cuts) {
    constraint_system_->refuse({});
    substep.last = smaller == kMostHalvings;
    const double made = make(stepper, substep, again, cuts < kMostCuts);
    again = again || touched_;
    if (made < 0) {
      if (substep.last || !touched_) {
        // A state that is not finite is reported by the caller.
        const bool finite = all_finite({x_next, start_.size()});
        if (finite && constraint_system_->refusal().empty())
          constraint_system_->refuse("constraints and colliders: this step has no end");
        if (finite || !constraint_system_->refusal().empty()) std::copy_n(x, start_.size(), x_next);
        return false;
      }
      substep.r *= 0.5;
      ++smaller;
      continue;
    }
    const double now = substep.t + std::min(made, 1.0) * substep.r;
    if (!(now < t + h * (1 - kSimultaneous * kSimultaneous))) break;
    std::copy_n(x_next, start_.size(), start_.data());
    substep = {now, t + h - now, start_.data(), x_next};
  }
  if (again) stepper.restart();
  return all_finite({x_next, start_.size()});
}

}  // namespace sim
