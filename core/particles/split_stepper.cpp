#include "core/particles/split_stepper.h"

#include <algorithm>

#include "core/base/exponential.h"

namespace sim {
namespace {

int stage_count(const SplitPlan& plan) {
  return static_cast<int>(plan.kick.size()) + (plan.drift.front() != 0 ? 1 : 0);
}

}  // namespace

template <class Real>
SplitStepper<Real>::SplitStepper(ParticleSystem& system, const SplitPlan& plan)
    : system_(&system),
      state_(system.layout()),
      closes_(plan.closes() && system.other_forces().empty()),
      sweeps_(system, stage_count(plan)) {
  double start = 0;
  if (plan.drift.front() != 0) parts_.push_back({0, plan.drift.front(), 0, false});
  start = plan.drift.front();
  for (std::size_t i = 0; i < plan.kick.size(); ++i) {
    parts_.push_back({plan.kick[i], plan.drift[i + 1], start, true});
    start += plan.drift[i + 1];
  }
  stages_.resize(parts_.size());

  const Layout half(system.layout().n(), 3, kBlock<Real>);
  const auto drifts =
      std::count_if(parts_.begin(), parts_.end(), [](const Part& part) { return part.drift != 0; });
  if (drifts > 1) positions_ = ArrayOf<Real>(half.size());
  if (system.has_other_forces()) forces_ = Array(half.size());
  if (closes_) acceleration_ = ArrayOf<Real>(half.size());
  if (system.motion().inverse_masses) {
    const Layout one(system.layout().n(), 1);
    for (std::size_t s = 0; s < parts_.size(); ++s) {
      keeps_.emplace_back(one.size());
      gains_.emplace_back(one.size());
    }
  }
}

// The factors of a kick of length tau under the damping of each particle.
template <class Real>
void SplitStepper<Real>::damp(KickStage<Real>& stage, std::size_t s, double tau) {
  const Motion& motion = system_->motion();
  const Damping common = damping(motion.damping * motion.inverse_mass, tau);
  stage.keep = common.keep;
  stage.gain = common.gain;
  if (!motion.inverse_masses) return;
  const Layout one(system_->layout().n(), 1);
  double* const keeps = one.block(keeps_[s].data(), 0);
  double* const gains = one.block(gains_[s].data(), 0);
  for (int i = 0; i < one.n(); ++i) {
    const Damping own = damping(motion.damping * motion.inverse_masses[i], tau);
    keeps[i] = own.keep;
    gains[i] = own.gain;
  }
  stage.keeps = keeps;
  stage.gains = gains;
}

template <class Real>
void SplitStepper<Real>::write(double h, const Real* x, Real* x_next) {
  const Layout& layout = state_.layout();
  const Layout half(layout.n(), 3, kBlock<Real>);
  auto drifts =
      std::count_if(parts_.begin(), parts_.end(), [](const Part& part) { return part.drift != 0; });
  const bool new_step_size = h != h_;
  h_ = h;
  const Real* q[3];
  for (int axis = 0; axis < 3; ++axis) q[axis] = layout.block(x, axis);

  for (std::size_t s = 0; s < parts_.size(); ++s) {
    const Part& part = parts_[s];
    KickStage<Real>& stage = stages_[s];
    const bool first = s == 0, last = s + 1 == parts_.size();
    if (new_step_size) damp(stage, s, part.kick * h);
    stage.drift = part.drift * h;
    stage.check = last;
    // Positions alternate between two places, such that the last ones come to lie in x_next.
    if (part.drift != 0) --drifts;
    for (int axis = 0; axis < 3; ++axis) {
      stage.q[axis] = q[axis];
      stage.v[axis] = layout.block(first ? x : x_next, 3 + axis);
      stage.v_next[axis] = layout.block(x_next, 3 + axis);
      stage.q_next[axis] = nullptr;
      if (part.drift != 0)
        stage.q_next[axis] =
            drifts % 2 == 0 ? layout.block(x_next, axis) : half.block(positions_.data(), axis);
      if (part.drift != 0) q[axis] = stage.q_next[axis];
      Real* const kept = closes_ ? half.block(acceleration_.data(), axis) : nullptr;
      stage.a[axis] = last ? kept : nullptr;
      // A drift alone is a kick of length 0 by anything.
      stage.known[axis] = !part.evaluates ? stage.v[axis] : first && known_ ? kept : nullptr;
      if constexpr (std::is_same_v<Real, double>)
        if (system_->has_other_forces()) stage.force[axis] = half.block(forces_.data(), axis);
    }
  }
}

template <class Real>
bool SplitStepper<Real>::step(double t, double h, const double* x, double* x_next) {
  const Real* const from = state_.from(x);
  write(h, from, state_.to(x_next));
  known_ = closes_;
  if constexpr (std::is_same_v<Real, double>)
    if (system_->has_other_forces()) return gather_and_step(t, h, x);
  return sweeps_.run(
      [&](int s) -> const Real* const* {
        const KickStage<Real>& stage = stages_[static_cast<std::size_t>(s)];
        return stage.known[0] ? nullptr : stage.q;
      },
      [&](Rings<Real>& rings, int s, int begin, int end) {
        const KickStage<Real>& stage = stages_[static_cast<std::size_t>(s)];
        const bool finite = kernels_.kick(rings, system_->motion(), stage, begin, end);
        if (stage.check) state_.publish(x_next, begin, end);
        return finite;
      });
}

// Other forces may read any particle: each stage is complete before the next.
template <class Real>
bool SplitStepper<Real>::gather_and_step(double t, double h,
                                         const double* x) requires std::is_same_v<Real, double> {
  const Layout half(system_->layout().n(), 3);
  bool finite = true;
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    const KickStage<double>& stage = stages_[s];
    ParticleView view = system_->view(t + parts_[s].start * h, x);
    view.x = stage.q[0];
    view.y = stage.q[1];
    view.z = stage.q[2];
    view.vx = view.vy = view.vz = nullptr;
    const auto [fx, fy, fz] = half.axes(forces_.data());
    finite = sweeps_.run_alone(static_cast<int>(s), view, {fx, fy, fz},
                               stage.known[0] ? nullptr : stage.q,
                               [&](Rings<double>& rings, int, int begin, int end) {
                                 return kernels_.kick(rings, system_->motion(), stage, begin, end);
                               });
  }
  return finite;
}

template class SplitStepper<double>;
template class SplitStepper<float>;

}  // namespace sim
