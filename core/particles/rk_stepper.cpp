#include "core/particles/rk_stepper.h"

#include <stdexcept>

namespace sim {

RkStepper::RkStepper(ParticleSystem& system, const ExplicitPlan& plan, std::span<Array> kept)
    : system_(&system),
      plan_(plan),
      stages_(plan.stages),
      sweeps_(system, plan.stages),
      kept_(kept) {
  if (stages_ > Row::kMost) throw std::logic_error("a tableau has more stages than a row holds");
  const Layout half(system.layout().n(), 3);
  for (int s = 1; s + 1 < stages_ && kept.empty(); ++s) own_.emplace_back(half.size());
  if (stages_ > 1) positions_ = Array(half.size());
  if (system.has_other_forces()) forces_ = Array(half.size());
  if (system.needs_velocities() && stages_ > 1)
    for (Array& velocity : velocities_) velocity = Array(half.size());
  for (Script& script : scripts_) script.stages.resize(static_cast<std::size_t>(stages_));
}

void RkStepper::write(Script& script, double h, const double* x, double* x_next) {
  script.h = h;
  script.x = x;
  script.x_next = x_next;
  const Layout& layout = system_->layout();
  const Layout half(layout.n(), 3);
  const int last = stages_ - 1;

  // Where stage s finds its positions and keeps its acceleration. The positions alternate between
  // two places, such that those after the last stage come to lie in x_next.
  const auto positions = [&](int s, int axis) {
    return (stages_ - s) % 2 == 0 ? layout.block(x_next, axis)
                                  : half.block(positions_.data(), axis);
  };
  const auto acceleration = [&](int s, int axis) {
    if (!kept_.empty()) return half.block(kept_[static_cast<std::size_t>(s)].data(), axis);
    return s == 0 ? layout.block(x_next, 3 + axis)
                  : half.block(own_[static_cast<std::size_t>(s - 1)].data(), axis);
  };
  const auto add = [&](Row& row, double coef, int s) {
    if (coef == 0) return;
    const double* const from[3] = {acceleration(s, 0), acceleration(s, 1), acceleration(s, 2)};
    row.add(coef, from);
  };

  for (int s = 0; s < stages_; ++s) {
    RkStage& stage = script.stages[static_cast<std::size_t>(s)];
    stage = {};
    for (int axis = 0; axis < 3; ++axis) {
      stage.q0[axis] = layout.block(x, axis);
      stage.v0[axis] = layout.block(x, 3 + axis);
      stage.q[axis] = s > 0 ? positions(s, axis) : !kept_.empty() ? nullptr : stage.q0[axis];
      stage.q_next[axis] = positions(s + 1, axis);
      if (system_->has_other_forces()) stage.force[axis] = half.block(forces_.data(), axis);
      if (s < last || !kept_.empty()) stage.a[axis] = acceleration(s, axis);
      if (s == last)
        stage.v_next[axis] = layout.block(x_next, 3 + axis);
      else if (system_->needs_velocities())
        stage.v_next[axis] = half.block(velocities_[(s + 1) % 2].data(), axis);
    }
    // The weights of what follows: the next row of A, or b.
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

bool RkStepper::step(double t, double h, const double* x, double* x_next) {
  Script& script = scripts_[x < x_next];
  if (!script.fits(h, x, x_next)) write(script, h, x, x_next);
  const RkSweep sweep = system_->kernels().rk;
  const auto piece = [&](Rings& rings, int s, int begin, int end) {
    return sweep(rings, system_->motion(), script.stages[static_cast<std::size_t>(s)], begin, end);
  };
  const auto positions = [&](int s) -> const double* const* {
    const RkStage& stage = script.stages[static_cast<std::size_t>(s)];
    return stage.q[0] ? stage.q : nullptr;
  };
  if (!system_->has_other_forces()) return sweeps_.run(positions, piece);

  // Other forces may read any particle: each stage is complete before the next.
  const Layout half(system_->layout().n(), 3);
  const auto at = [&](Array& values, int axis) { return half.block(values.data(), axis); };
  bool finite = true;
  for (int s = 0; s < stages_; ++s) {
    const RkStage& stage = script.stages[static_cast<std::size_t>(s)];
    ParticleView view = system_->view(t + plan_.c[static_cast<std::size_t>(s)] * h, x);
    view.x = stage.q[0];
    view.y = stage.q[1];
    view.z = stage.q[2];
    if (s > 0 && system_->needs_velocities()) {
      view.vx = at(velocities_[s % 2], 0);
      view.vy = at(velocities_[s % 2], 1);
      view.vz = at(velocities_[s % 2], 2);
    }
    finite = sweeps_.run_alone(s, view, {at(forces_, 0), at(forces_, 1), at(forces_, 2)},
                               positions(s), piece);
  }
  return finite;
}

}  // namespace sim
