#include "core/particles/explicit/rk_stepper.h"

#include <stdexcept>
#include <type_traits>

namespace sim {

template <class Real>
RkStepper<Real>::RkStepper(Particles& system, const ExplicitPlan& plan,
                           std::span<ArrayOf<Real>> kept)
    : system_(&system),
      state_(system.layout()),
      plan_(plan),
      stages_(plan.stages),
      sweeps_(system, plan.stages),
      kept_(kept) {
  if (stages_ > Row<Real>::kMost)
    throw std::logic_error("a tableau has more stages than a row holds");
  const Layout half(system.layout().n(), 3, kBlock<Real>);
  for (int s = 1; s + 1 < stages_ && kept.empty(); ++s) own_.emplace_back(half.size());
  if (stages_ > 1) positions_ = ArrayOf<Real>(half.size());
  if (system.has_other_forces()) forces_ = Array(half.size());
  if (system.needs_velocities() && stages_ > 1)
    for (Array& velocity : velocities_) velocity = Array(half.size());
  for (Script& script : scripts_) script.stages.resize(static_cast<std::size_t>(stages_));
  if (kept.empty() && !system.contacts().empty()) contact_pass_.emplace(system, stages_ == 1);
}

template <class Real>
void RkStepper<Real>::write(Script& script, double h, const Real* x, Real* x_next) {
  script.h = h;
  script.x = x;
  script.x_next = x_next;
  const Layout& layout = state_.layout();
  const Layout half(layout.n(), 3, kBlock<Real>);
  const int last = stages_ - 1;

  // Each stage reads its positions and stores its acceleration here. The positions alternate
  // between two arrays, such that those after the last stage are in x_next.
  const auto positions = [&](int s, int axis) {
    return (stages_ - s) % 2 == 0 ? layout.block(x_next, axis)
                                  : half.block(positions_.data(), axis);
  };
  const auto acceleration = [&](int s, int axis) {
    if (!kept_.empty()) return half.block(kept_[static_cast<std::size_t>(s)].data(), axis);
    return s == 0 ? layout.block(x_next, 3 + axis)
                  : half.block(own_[static_cast<std::size_t>(s - 1)].data(), axis);
  };
  const auto add = [&](Row<Real>& row, double coef, int s) {
    if (coef == 0) return;
    const Real* const from[3] = {acceleration(s, 0), acceleration(s, 1), acceleration(s, 2)};
    row.add(coef, from);
  };

  for (int s = 0; s < stages_; ++s) {
    RkStage<Real>& stage = script.stages[static_cast<std::size_t>(s)];
    stage = {};
    for (int axis = 0; axis < 3; ++axis) {
      stage.q0[axis] = layout.block(x, axis);
      stage.v0[axis] = layout.block(x, 3 + axis);
      stage.q[axis] = s > 0 ? positions(s, axis) : !kept_.empty() ? nullptr : stage.q0[axis];
      stage.q_next[axis] = positions(s + 1, axis);
      if (s < last || !kept_.empty()) stage.a[axis] = acceleration(s, axis);
      if (s == last) stage.v_next[axis] = layout.block(x_next, 3 + axis);
      if constexpr (std::is_same_v<Real, double>) {
        if (system_->has_other_forces()) stage.force[axis] = half.block(forces_.data(), axis);
        if (s < last && system_->needs_velocities())
          stage.v_next[axis] = half.block(velocities_[(s + 1) % 2].data(), axis);
      }
    }
    // The weights of the next row of A or, after the last stage, of b.
    const auto weight = [&](int j) {
      return s == last ? plan_.b[static_cast<std::size_t>(j)] : plan_.a_at(s + 1, j);
    };
    for (int j = 0; j < s; ++j) add(stage.v_now, h * plan_.a_at(s, j), j);
    for (int j = 0; j <= s; ++j) stage.drift += h * weight(j);
    for (int l = 0; l < s; ++l) {
      double squared = 0;
      for (int j = l + 1; j <= s; ++j) squared += weight(j) * plan_.a_at(j, l);
      add(stage.q_row, h * h * squared, l);
      add(stage.v_row, h * weight(l), l);
    }
    stage.kick = h * weight(s);
  }
}

template <class Real>
bool RkStepper<Real>::step(double t, double h, int count, const double* x, double* x_next) {
  for (;; x = x_next) {
    const Real* const from = state_.from(x);
    Real* const to = state_.to(x_next);
    Script& script = scripts_[from < to];
    if (contact_pass_) contact_pass_->begin(t, t + h);
    if (!script.fits(h, from, to)) write(script, h, from, to);
    if constexpr (std::is_same_v<Real, double>)
      if (system_->has_other_forces())
        return system_->sweeps_other_forces() ? sweep_and_step(t, h, x, script)
                                              : gather_and_step(t, h, x, script);
    const bool seen = --count == 0;
    const bool finite = sweeps_.run(
        stages_, [&](int s) { return positions(script, s); },
        [&](Rings<Real>& rings, int s, int begin, int end) {
          const bool good = end_sweep(t, script, rings, s, begin, end);
          if (seen && s + 1 == stages_) state_.publish(x_next, begin, end);
          return good;
        });
    if (seen) return finite && (!contact_pass_ || contact_pass_->succeeded());
  }
}

template <class Real>
ParticleView RkStepper<Real>::view(double t, double h, const double* x, const Script& script,
                                   int s) const {
  const RkStage<Real>& stage = at(script, s);
  ParticleView view = system_->view(t + plan_.c[static_cast<std::size_t>(s)] * h, x);
  if constexpr (std::is_same_v<Real, double>) {
    view.x = stage.q[0];
    view.y = stage.q[1];
    view.z = stage.q[2];
    if (s == 0 || !system_->needs_velocities()) return view;
    const Layout half(view.n, 3);
    const Array& velocity = velocities_[s % 2];
    view.vx = half.block(velocity.data(), 0);
    view.vy = half.block(velocity.data(), 1);
    view.vz = half.block(velocity.data(), 2);
  }
  return view;
}

template <class Real>
bool RkStepper<Real>::end_sweep(double t, const Script& script, Rings<Real>& rings, int s,
                                int begin, int end) {
  const bool good = kernels_.rk(rings, system_->motion(), at(script, s), begin, end);
  if (contact_pass_ && s + 1 == stages_) resolve(t, script, begin, end);
  return good;
}

// Other forces may read any particle, so that each stage is complete before the next.
template <class Real>
bool RkStepper<Real>::gather_and_step(double t, double h, const double* x, const Script& script) {
  const auto [fx, fy, fz] = Layout(system_->layout().n(), 3).axes(forces_.data());
  bool finite = true;
  for (int s = 0; s < stages_; ++s)
    finite = sweeps_.run_alone(s, view(t, h, x, script, s), {fx, fy, fz}, positions(script, s),
                               [&](Rings<Real>& rings, int, int begin, int end) {
                                 return end_sweep(t, script, rings, s, begin, end);
                               });
  return finite && (!contact_pass_ || contact_pass_->succeeded());
}

// Forces between neighbours in id are evaluated while the stages sweep over the particles.
template <class Real>
bool RkStepper<Real>::sweep_and_step(double t, double h, const double* x, const Script& script) {
  const auto [fx, fy, fz] = Layout(system_->layout().n(), 3).axes(forces_.data());
  const bool finite = sweeps_.run_gathering(
      stages_, [&](int s) { return positions(script, s); },
      [&](int s) { return view(t, h, x, script, s); }, {fx, fy, fz},
      [&](Rings<Real>& rings, int s, int begin, int end) {
        return end_sweep(t, script, rings, s, begin, end);
      });
  return finite && (!contact_pass_ || contact_pass_->succeeded());
}

template <class Real>
void RkStepper<Real>::resolve(double t, const Script& script, int begin, int end) {
  if constexpr (std::is_same_v<Real, double>) {
    const Layout& layout = state_.layout();
    contact_pass_->end(t, script.h, layout.axes(script.x), layout.axes(script.x, 3),
                       layout.axes(script.x_next), layout.axes(script.x_next, 3), begin, end);
  }
}

template class RkStepper<double>;
template class RkStepper<float>;

}  // namespace sim
