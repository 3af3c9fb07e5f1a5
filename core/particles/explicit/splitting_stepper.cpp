#include "core/particles/explicit/splitting_stepper.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/math/exponential.h"
#include "core/particles/explicit/resting_contact_kernel.h"

namespace sim {
namespace {

// True if the other forces at the end of a step are those at the start of the next: they follow
// from the positions, where time is n h and not (n - 1) h + h.
bool forces_stay(const Particles& system) {
  return std::ranges::all_of(system.other_forces(), [](const Force* force) {
    return force->conservative() && !force->depends_on_velocity() && force->internal_size() == 0;
  });
}

}  // namespace

template <class Real>
std::vector<typename SplittingStepper<Real>::Part> SplittingStepper<Real>::parts_of(
    const SplitPlan& plan) {
  std::vector<Part> parts;
  double start = plan.drift.front();
  if (start != 0) parts.push_back({0, start, 0, false});
  for (std::size_t i = 0; i < plan.kick.size(); ++i) {
    parts.push_back({plan.kick[i], plan.drift[i + 1], start, true});
    start += plan.drift[i + 1];
  }
  return parts;
}

template <class Real>
SplittingStepper<Real>::SplittingStepper(Particles& system, const SplitPlan& plan)
    : system_(&system),
      state_(system.layout()),
      parts_(parts_of(plan)),
      drifts_(std::ranges::count_if(parts_, [](const Part& part) { return part.drift != 0; })),
      contact_inside_(plan.closes() && plan.kick.size() == 2),
      closes_(plan.closes() && forces_stay(system) &&
              (contact_inside_ || system.contacts().empty())),
      sweeps_(system, at_once() * static_cast<int>(parts_.size()) * (midpoint_kicks() ? 2 : 1)),
      kicks_(parts_.size() * (midpoint_kicks() ? 2 : 1)) {
  stages_.reserve(kicks_.size() * static_cast<std::size_t>(at_once()));
  moments_.reserve(stages_.capacity());
  if (!system.contacts().empty()) {
    contact_pass_.emplace(system, plan.order == 1);
    contacts_.reserve(stages_.capacity());
  }
  const Layout half(system.layout().n(), 3, kBlock<Real>);
  if (drifts_ > 1 || at_once() > 1) positions_ = ArrayOf<Real>(half.size());
  if (system.has_other_forces()) forces_ = Array(half.size());
  if (midpoint_kicks()) v_half_ = ArrayOf<Real>(half.size());
  if (closes_) v_after_ = ArrayOf<Real>(half.size());
  if (closes_ && !system.contacts().empty()) a_ = ArrayOf<Real>(half.size());
  if (system.motion().inverse_masses) {
    const Layout one(system.layout().n(), 1);
    for (std::size_t slot = 0; slot < kicks_.size(); ++slot) {
      keeps_.emplace_back(one.size());
      gains_.emplace_back(one.size());
    }
  }
}

template <class Real>
int SplittingStepper<Real>::at_once() const {
  // Several steps are not fused if other forces read the time, or if a method of one drift would
  // need another array.
  const bool alternates = drifts_ > 1 || closes_ || std::is_same_v<Real, float>;
  if (!alternates || !system_->other_forces().empty()) return 1;
  if (!system_->contacts().empty() && (!contact_inside_ || system_->contacts().move())) return 1;
  return std::max(1, kStagesAtOnce / static_cast<int>(parts_.size()));
}

// The kick of length tau under the damping of each particle.
template <class Real>
Kick SplittingStepper<Real>::kick(std::size_t slot, double tau) {
  const Motion& motion = system_->motion();
  const Damping common = damping(motion.damping * motion.inverse_mass, tau);
  if (!motion.inverse_masses) return {common.keep, common.gain, nullptr, nullptr};
  const Layout one(system_->layout().n(), 1);
  double* const keeps = one.block(keeps_[slot].data(), 0);
  double* const gains = one.block(gains_[slot].data(), 0);
  for (int i = 0; i < one.n(); ++i) {
    const Damping own = damping(motion.damping * motion.inverse_masses[i], tau);
    keeps[i] = own.keep;
    gains[i] = own.gain;
  }
  return {0, 0, keeps, gains};
}

template <class Real>
void SplittingStepper<Real>::set_step_size(double h) {
  if (h == h_) return;
  const std::size_t count = parts_.size();
  for (std::size_t p = 0; p < count; ++p) kicks_[p] = kick(p, parts_[p].kick * h);
  for (std::size_t p = count; p < kicks_.size(); ++p)
    kicks_[p] = kick(p, 0.5 * parts_[p - count].kick * h);
  h_ = h;
  known_ = false;
}

// Writes the stages of `count` steps.
template <class Real>
void SplittingStepper<Real>::write(int count, const Real* x, Real* x_next) {
  const Layout& layout = state_.layout();
  const Layout half(layout.n(), 3, kBlock<Real>);
  const std::array<Real*, 3> after = half.axes(v_after_.data()), v_next = layout.axes(x_next, 3);
  std::array<const Real*, 3> q = layout.axes(x), v = layout.axes(x, 3);
  if (known_) std::ranges::copy(after, v.begin());
  auto drifts = count * drifts_;

  stages_.clear();
  moments_.clear();
  contacts_.clear();
  for (int step = 0; step < count; ++step)
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      if (closes_ && p == 0 && step > 0) continue;  // made with the last part of the step before
      const bool last = p + 1 == parts_.size(), seen = last && step + 1 == count;
      const bool both = closes_ && last;
      Moment moment{parts_[p].start, {}};
      if (midpoint_kicks() && parts_[p].kicks) {
        const std::array<Real*, 3> v_half = half.axes(v_half_.data());
        KickStage<Real>& first = stages_.emplace_back();
        first.kicks = true;
        first.kick = kicks_[parts_.size() + p];
        for (int axis = 0; axis < 3; ++axis) {
          first.q[axis] = q[axis];
          first.v[axis] = moment.v[axis] = v[axis];
          first.v_next[axis] = v_half[axis];
          if constexpr (std::is_same_v<Real, double>)
            first.force[axis] = half.block(forces_.data(), axis);
        }
        moments_.push_back(moment);
        if (contact_pass_) contacts_.push_back({});
        std::ranges::copy(v_half, moment.v);
      }
      moments_.push_back(moment);
      KickStage<Real>& stage = stages_.emplace_back();
      stage.kicks = parts_[p].kicks && !(p == 0 && known_);
      stage.kick = kicks_[p];
      stage.next_kick = kicks_.front();
      const double drift = parts_[both && !seen ? 0 : p].drift;
      stage.drift = drift * h_;
      stage.check = seen;
      // Positions alternate between two arrays, such that the last ones are in x_next.
      if (drift != 0) --drifts;
      const std::array<Real*, 3> q_next =
          drifts % 2 == 0 ? layout.axes(x_next) : half.axes(positions_.data());
      for (int axis = 0; axis < 3; ++axis) {
        stage.q[axis] = q[axis];
        stage.v[axis] = v[axis];
        if (stage.kicks && (seen || !both || contact_pass_))
          stage.v_next[axis] = closes_ && !last ? after[axis] : v_next[axis];
        if (both) stage.v_after[axis] = after[axis];
        if (both && contact_pass_) stage.a[axis] = half.block(a_.data(), axis);
        if (stage.kicks) v[axis] = closes_ ? after[axis] : v_next[axis];
        if (drift != 0) q[axis] = stage.q_next[axis] = q_next[axis];
        if constexpr (std::is_same_v<Real, double>)
          if (system_->has_other_forces()) stage.force[axis] = half.block(forces_.data(), axis);
      }
      if (contact_pass_) contacts_.push_back(contact_of(step, p, stage, x, x_next));
    }
}

template <class Real>
typename SplittingStepper<Real>::ContactStage SplittingStepper<Real>::contact_of(
    int step, std::size_t part, const KickStage<Real>& stage, const Real* x, Real* x_next) {
  ContactStage settle{.start = static_cast<double>(step), .holds = contact_inside_ && part == 1};
  if constexpr (std::is_same_v<Real, double>) {
    const Layout& layout = state_.layout();
    const auto after = Layout(layout.n(), 3).axes(v_after_.data());
    const auto v_next = layout.axes(x_next, 3);
    settle.v = v_next;
    if (closes_) settle.v_after = after;
    settle.ends = !contact_inside_ && part + 1 == parts_.size();
    settle.drifts = contact_inside_ && stage.q_next[0];
    settle.q = settle.ends ? layout.axes(x) : std::to_array(stage.q);
    settle.v0 = settle.ends || part == 0 ? layout.axes(x, 3) : layout.axes<const double>(x_next, 3);
    settle.q_next = settle.ends ? layout.axes(x_next) : std::to_array(stage.q_next);
    settle.v_half = closes_ ? after : v_next;
  }
  return settle;
}

// Makes the kick of stage s for particles [begin, end). Accelerations are stored for the particles
// with resting contacts.
template <class Real>
bool SplittingStepper<Real>::kick(Rings<Real>& rings, std::size_t s, int begin, int end) {
  const KickStage<Real>& stage = stages_[s];
  if (!stage.a[0] || contact_pass_->any_resting(begin, end))
    return kernels_.kick(rings, system_->motion(), stage, begin, end);
  KickStage<Real> free = stage;
  for (Real*& a : free.a) a = nullptr;
  return kernels_.kick(rings, system_->motion(), free, begin, end);
}

// Resolves the contacts of particles [begin, end) after stage s.
template <class Real>
void SplittingStepper<Real>::resolve(std::size_t s, int begin, int end) {
  if constexpr (std::is_same_v<Real, double>) {
    const ContactStage& at = contacts_[s];
    const KickStage<double>& stage = stages_[s];
    const double t = t_ + at.start * h_;
    if (at.holds) {
      RestingContactKick kick;
      kick.next = stage.next_kick;
      kick.drift = stage.drift;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        kick.q[axis] = stage.q[axis];
        kick.v[axis] = at.v[axis];
        if (!closes_) continue;
        kick.a[axis] = stage.a[axis];
        kick.v_after[axis] = at.v_after[axis];
        if (at.drifts) kick.q_next[axis] = at.q_next[axis];
      }
      contact_pass_->constrain_after_kick(t + h_, kick, begin, end);
    }
    // A drift after the second kick belongs to the next step.
    const double start = at.holds ? t + h_ : t;
    if (at.drifts)
      contact_pass_->resolve_after_drift(start, h_, at.q, at.v0, at.q_next, at.v_half, begin, end);
    else if (at.ends)
      contact_pass_->end(t, h_, at.q, at.v0, at.q_next, at.v, begin, end);
  }
}

template <class Real>
bool SplittingStepper<Real>::step(double t, double h, int count, const double* x, double* x_next) {
  set_step_size(h);
  const Real* const from = state_.from(x);
  t_ = t;
  if (contact_pass_) contact_pass_->begin(t, t + h);
  write(count, from, state_.to(x_next));
  known_ = closes_;
  if constexpr (std::is_same_v<Real, double>)
    if (system_->has_other_forces()) return gather_and_step(t, x);
  const bool all_finite = sweeps_.run(
      static_cast<int>(stages_.size()),
      [&](int s) -> const Real* const* {
        const KickStage<Real>& stage = stages_[static_cast<std::size_t>(s)];
        return stage.kicks ? stage.q : nullptr;
      },
      [&](Rings<Real>& rings, int s, int begin, int end) {
        const KickStage<Real>& stage = stages_[static_cast<std::size_t>(s)];
        const bool finite = kick(rings, static_cast<std::size_t>(s), begin, end);
        if (contact_pass_) resolve(static_cast<std::size_t>(s), begin, end);
        if (stage.check) state_.publish(x_next, begin, end);
        return finite;
      });
  return all_finite && contact_succeeded();
}

// Forces that join neighbours in id alone are evaluated while the stages sweep over the particles.
// Other forces may read any particle: then each stage is complete before the next.
template <class Real>
bool SplittingStepper<Real>::gather_and_step(double t, const double* x) {
  if constexpr (std::is_same_v<Real, double>) {
    const auto stage = [&](int s) -> const auto& { return stages_[static_cast<std::size_t>(s)]; };
    const auto positions = [&](int s) -> const double* const* {
      return stage(s).kicks ? stage(s).q : nullptr;
    };
    const auto view = [&](int s) {
      const Moment& moment = moments_[static_cast<std::size_t>(s)];
      ParticleView now = system_->view(t + moment.start * h_, x);
      now.x = stage(s).q[0];
      now.y = stage(s).q[1];
      now.z = stage(s).q[2];
      now.vx = moment.v[0];
      now.vy = moment.v[1];
      now.vz = moment.v[2];
      return now;
    };
    const auto sweep = [&](Rings<double>& rings, int s, int begin, int end) {
      const bool good = kick(rings, static_cast<std::size_t>(s), begin, end);
      if (contact_pass_) resolve(static_cast<std::size_t>(s), begin, end);
      return good;
    };
    const auto [fx, fy, fz] = Layout(system_->layout().n(), 3).axes(forces_.data());
    const int count = static_cast<int>(stages_.size());
    if (system_->sweeps_other_forces())
      return sweeps_.run_gathering(count, positions, view, {fx, fy, fz}, sweep) &&
             contact_succeeded();
    bool finite = true;
    for (int s = 0; s < count; ++s)
      finite = sweeps_.run_alone(s, view(s), {fx, fy, fz}, positions(s), sweep);
    return finite && contact_succeeded();
  }
  return false;
}

template class SplittingStepper<double>;
template class SplittingStepper<float>;

}  // namespace sim
