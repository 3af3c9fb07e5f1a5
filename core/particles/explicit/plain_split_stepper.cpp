#include "core/particles/explicit/plain_split_stepper.h"

#include <algorithm>

#include "core/base/finite.h"
#include "core/math/exponential.h"

namespace sim {

PlainSplitStepper::PlainSplitStepper(Particles& particles, const SplitPlan& plan, Holding* holding)
    : particles_(&particles),
      holding_(holding),
      plan_(plan),
      half_(particles.layout().n(), 3),
      one_(particles.layout().n(), 1),
      settles_inside_(plan.closes() && plan.kick.size() == 2),
      closes_(plan.closes() && particles.other_forces().empty() &&
              (settles_inside_ || particles.contacts().empty())),
      a_(half_.size()),
      memory_(particles.memory_size()) {
  // Where there are constraints, contact acts around steps.
  if (!particles.contacts().empty() && !holding) settling_.emplace(particles, plan.order == 1);
  if (holding) {
    solver_.emplace(holding->constraints());
    weights_.resize(plan.kick.size(), std::vector<double>(static_cast<std::size_t>(one_.n())));
  }
  if (midpoint_kicks()) v_half_ = Array(half_.size());
  for (std::size_t slot = 0; slot < (midpoint_kicks() ? 2 : 1) * plan.kick.size(); ++slot) {
    keeps_.emplace_back(one_.size());
    gains_.emplace_back(one_.size());
  }
  for (Array& k : k_) k = Array(particles.memory_size());
}

// A kick of length tau under the damping of each particle.
void PlainSplitStepper::set_step_size(double h) {
  if (h == h_) return;
  const Motion& motion = particles_->motion();
  const std::size_t kicks = plan_.kick.size();
  for (std::size_t slot = 0; slot < keeps_.size(); ++slot) {
    double* const keeps = one_.block(keeps_[slot].data(), 0);
    double* const gains = one_.block(gains_[slot].data(), 0);
    const double tau = (slot < kicks ? 1.0 : 0.5) * plan_.kick[slot % kicks] * h;
    for (int j = 0; j < one_.n(); ++j) {
      const double inverse = motion.inverse_masses ? motion.inverse_masses[j] : motion.inverse_mass;
      const Damping own = damping(motion.damping * inverse, tau);
      keeps[j] = own.keep;
      gains[j] = own.gain;
      if (solver_ && slot < kicks)
        weights_[slot][static_cast<std::size_t>(j)] =
            holding_->constraints().weights()[static_cast<std::size_t>(j)] * (own.gain / tau);
    }
  }
  h_ = h;
  held_ = false;
}

void PlainSplitStepper::drift(double t, double tau, double* state) {
  if (tau == 0) return;
  const Layout& layout = particles_->layout();
  const auto q = layout.axes(state), v = layout.axes(state, 3);
  particles_->team().run_parts(layout.n(), 8, [&](int begin, int end) {
    for (int axis = 0; axis < 3; ++axis)
      for (int i = begin; i < end; ++i) q[axis][i] += tau * v[axis][i];
  });

  const std::size_t size = particles_->memory_size();
  if (size == 0) return;
  double* const m = state + layout.size();
  constexpr double kPlace[] = {0, 0.5, 0.5, 1};
  for (int stage = 0; stage < 4; ++stage) {
    for (std::size_t i = 0; i < size; ++i)
      memory_[i] = stage == 0 ? m[i] : m[i] + kPlace[stage] * tau * k_[stage - 1][i];
    ParticleView view;
    view.t = t + kPlace[stage] * tau;
    view.memory = memory_.span();
    particles_->derive(view, k_[stage].data());
  }
  for (std::size_t i = 0; i < size; ++i)
    m[i] += tau / 6 * (k_[0][i] + 2 * k_[1][i] + 2 * k_[2][i] + k_[3][i]);
}

// A drift takes those that are led to where their paths are then.
void PlainSplitStepper::lead(double t, double tau, double* state) {
  const Layout& layout = particles_->layout();
  if (tau != 0) particles_->leads().chords(t, tau, layout.axes(state), layout.axes(state, 3));
}

// to := v after kick `slot` of the accelerations at hand.
void PlainSplitStepper::change(std::size_t slot, const std::array<double*, 3>& v,
                               const std::array<double*, 3>& to) {
  const auto a = half_.axes(a_.data());
  const double* const keeps = one_.block(keeps_[slot].data(), 0);
  const double* const gains = one_.block(gains_[slot].data(), 0);
  particles_->team().run_parts(half_.n(), 8, [&](int begin, int end) {
    for (int axis = 0; axis < 3; ++axis)
      for (int j = begin; j < end; ++j) to[axis][j] = keeps[j] * v[axis][j] + gains[j] * a[axis][j];
  });
}

// The accelerations at hand, which have drag, with what constraints make of them, but without drag.
void PlainSplitStepper::constrain(const ParticleView& view, const double* memory) {
  const std::array<double*, 3> a = half_.axes(a_.data());
  const double* const v[3] = {view.vx, view.vy, view.vz};
  particles_->leads().accelerate(view.t, a);
  holding_->constrain(view, memory, a.data());
  const Motion& motion = particles_->motion();
  for (int j = 0; j < half_.n(); ++j) {
    const double inverse = motion.inverse_masses ? motion.inverse_masses[j] : motion.inverse_mass;
    for (int axis = 0; axis < 3; ++axis) a[axis][j] += motion.damping * inverse * v[axis][j];
  }
}

// Drag is in the kick itself.
void PlainSplitStepper::kick(std::size_t i, double t, double led_t, double* state) {
  constexpr bool kDrag = false;
  const std::array<double*, 3> v = particles_->layout().axes(state, 3);
  const std::array<double*, 3> a = half_.axes(a_.data());
  ParticleView view = particles_->view(t, state);
  if (midpoint_kicks()) {
    const std::array<double*, 3> v_half = half_.axes(v_half_.data());
    particles_->accelerate(view, a.data(), solver_.has_value());
    if (solver_) constrain(view, state + holding_->memory_begin());
    change(plan_.kick.size() + i, v, v_half);
    particles_->leads().velocities(led_t, v_half);
    view.vx = v_half[0], view.vy = v_half[1], view.vz = v_half[2];
  }
  if (i > 0 || !known_) particles_->accelerate(view, a.data(), kDrag);
  change(i, v, v);
}

bool PlainSplitStepper::step(double t, double h, int /*count*/, const double* x, double* x_next) {
  set_step_size(h);
  const Layout& layout = particles_->layout();
  if (settling_) settling_->begin(t, t + h);
  if (solver_) holding_->refuse({});
  const std::size_t size = particles_->layout().size() + particles_->memory_size() +
                           (holding_ ? holding_->memory_size() : 0);
  std::copy_n(x, size, x_next);
  double start = plan_.drift.front();  // how far the drifts so far have led, in steps
  double kicked = 0;                   // and the kicks
  lead(t, start * h, x_next);
  drift(t, start * h, x_next);
  particles_->leads().velocities(t, layout.axes(x_next, 3));
  for (std::size_t i = 0; i < plan_.kick.size(); ++i) {
    kick(i, t + start * h, t + (kicked + 0.5 * plan_.kick[i]) * h, x_next);
    kicked += plan_.kick[i];
    const double d = plan_.drift[i + 1] * h;
    lead(t + start * h, d, x_next);
    if (solver_ && d != 0) {
      const bool factorised = held_ && i == 0;
      if (!solver_->lead(t + start * h, d, particles_->view(t, x_next), layout.axes(x_next),
                         layout.axes(x_next, 3), x_next + holding_->memory_begin(), weights_[i],
                         factorised))
        return refuse(x, x_next);
    }
    drift(t + start * h, d, x_next);
    start += plan_.drift[i + 1];
    particles_->leads().velocities(t + kicked * h, layout.axes(x_next, 3));
    if (settling_) settle(t, h, i, x, x_next);
  }
  known_ = closes_;
  particles_->leads().place(t + h, layout.axes(x_next), layout.axes(x_next, 3));
  if (solver_) {
    const ParticleView view = particles_->view(t + h, x_next);
    double* const memory = x_next + holding_->memory_begin();
    if (!solver_->hold(t + h, view, layout.axes(x_next), layout.axes(x_next, 3), memory,
                       weights_.back()))
      return refuse(x, x_next);
    holding_->constraints().follow(view, memory);
    // Where they move, times matter to the last bit.
    held_ = plan_.kick.front() == plan_.kick.back() && !holding_->constraints().move() &&
            holding_->memory_size() == 0;
  }
  return all_finite({x_next, size}) && (!settling_ || settling_->succeeded());
}

// No allowed state is in reach: the numbers stay finite, so that the reason is heard.
bool PlainSplitStepper::refuse(const double* x, double* x_next) const {
  const std::size_t size = holding_->memory_begin() + holding_->memory_size();
  if (all_finite({x_next, size})) std::copy_n(x, size, x_next);
  holding_->refuse(solver_->refusal());
  return false;
}

// Behind kick i and the drift after it.
void PlainSplitStepper::settle(double t, double h, std::size_t i, const double* x, double* x_next) {
  const Layout& layout = particles_->layout();
  const bool last = i + 1 == plan_.kick.size();
  const auto q = layout.axes(x_next), v = layout.axes(x_next, 3);
  particles_->team().run_parts(layout.n(), 16, [&](int begin, int end) {
    if (!settles_inside_) {
      if (last) settling_->end(t, h, layout.axes(x), layout.axes(x, 3), q, v, begin, end);
    } else if (last) {
      LyingKick kick;
      for (std::size_t axis = 0; axis < 3; ++axis) kick.q[axis] = q[axis], kick.v[axis] = v[axis];
      settling_->kicked(t + h, kick, begin, end);
    } else {
      settling_->drifted(t, h, layout.axes(x), layout.axes(x, 3), q, v, begin, end);
    }
  });
}

}  // namespace sim
