#include "core/particles/explicit/generic_splitting_stepper.h"

#include <algorithm>

#include "core/base/finite.h"
#include "core/math/exponential.h"
#include "core/particles/explicit/resting_contact_kernel.h"

namespace sim {

GenericSplittingStepper::GenericSplittingStepper(Particles& particles, const SplitPlan& plan,
                                                 ConstraintSystem* constraint_system)
    : particles_(&particles),
      constraint_system_(constraint_system),
      plan_(plan),
      half_(particles.layout().n(), 3),
      one_(particles.layout().n(), 1),
      contact_inside_(plan.closes() && plan.kick.size() == 2),
      closes_(plan.closes() && particles.other_forces().empty() &&
              (contact_inside_ || particles.contacts().empty())),
      a_(half_.size()),
      internal_drift_(particles) {
  // Scenes with constraints resolve contact outside of this stepper.
  if (!particles.contacts().empty() && !constraint_system)
    contact_pass_.emplace(particles, plan.order == 1);
  if (constraint_system) {
    solver_.emplace(constraint_system->constraints(), &particles.pool());
    kicked_ = Array(half_.size());
    weights_.resize(plan.kick.size(), std::vector<double>(static_cast<std::size_t>(one_.n())));
  }
  if (midpoint_kicks()) v_half_ = Array(half_.size());
  for (std::size_t slot = 0; slot < (midpoint_kicks() ? 2 : 1) * plan.kick.size(); ++slot) {
    keeps_.emplace_back(one_.size());
    gains_.emplace_back(one_.size());
  }
}

// The kick of length tau under the damping of each particle.
void GenericSplittingStepper::set_step_size(double h) {
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
            constraint_system_->constraints().weights()[static_cast<std::size_t>(j)] *
            (own.gain / tau);
    }
  }
  h_ = h;
  held_ = false;
}

// A SHAKE drift, or an implicit one beyond SHAKE's stability limit.
bool GenericSplittingStepper::constrained_drift(std::size_t i, double t, double d, double* state) {
  constexpr double kStable = 4;  // (omega d)^2
  const Layout& layout = particles_->layout();
  const auto q = layout.axes(state), v = layout.axes(state, 3);
  const ParticleView view = particles_->view(t, state);
  const double* const memory = state + constraint_system_->internal_begin();
  const auto n = static_cast<std::size_t>(layout.n());
  for (int axis = 0; axis < 3; ++axis)
    std::copy_n(v[static_cast<std::size_t>(axis)], n, half_.block(kicked_.data(), axis));
  const auto as_kicked = [&] {
    for (int axis = 0; axis < 3; ++axis)
      std::copy_n(half_.block(kicked_.data(), axis), n, v[static_cast<std::size_t>(axis)]);
  };
  const bool found =
      solver_->shake_positions(t, d, view, q, v, memory, weights_[i], held_ && i == 0);
  if (!found || solver_->stiffness(d, plan_.kick[i] * h_, view, memory) > kStable) {
    as_kicked();
    if (solver_->drift(t, d, view, q, v, memory, weights_[i])) {
      constraint_system_->count_implicit_drift();
      internal_drift_.drift(t, d, state);
      return true;
    }
    as_kicked();
    if (!solver_->shake_positions(t, d, view, q, v, memory, weights_[i], false)) return false;
  }
  drift(t, d, state);
  return true;
}

void GenericSplittingStepper::drift(double t, double tau, double* state) {
  if (tau == 0) return;
  const Layout& layout = particles_->layout();
  const auto q = layout.axes(state), v = layout.axes(state, 3);
  particles_->pool().run_parts(layout.n(), 8, [&](int begin, int end) {
    for (int axis = 0; axis < 3; ++axis)
      for (int i = begin; i < end; ++i) q[axis][i] += tau * v[axis][i];
  });
  internal_drift_.drift(t, tau, state);
}

// A drift moves kinematic particles along their prescribed paths.
void GenericSplittingStepper::lead(double t, double tau, double* state) {
  const Layout& layout = particles_->layout();
  if (tau != 0) particles_->prescribed().chords(t, tau, layout.axes(state), layout.axes(state, 3));
}

// to := v after kick `slot` under the current accelerations.
void GenericSplittingStepper::change(std::size_t slot, const std::array<double*, 3>& v,
                                     const std::array<double*, 3>& to) {
  const auto a = half_.axes(a_.data());
  const double* const keeps = one_.block(keeps_[slot].data(), 0);
  const double* const gains = one_.block(gains_[slot].data(), 0);
  particles_->pool().run_parts(half_.n(), 8, [&](int begin, int end) {
    for (int axis = 0; axis < 3; ++axis)
      for (int j = begin; j < end; ++j) to[axis][j] = keeps[j] * v[axis][j] + gains[j] * a[axis][j];
  });
}

// Adds constraint forces to the current accelerations, which include drag, and takes the drag out
// again.
void GenericSplittingStepper::add_constraint_forces(const ParticleView& view,
                                                    const double* memory) {
  const std::array<double*, 3> a = half_.axes(a_.data());
  const double* const v[3] = {view.vx, view.vy, view.vz};
  particles_->prescribed().accelerate(view.t, a);
  constraint_system_->add_constraint_forces(view, memory, a.data());
  const Motion& motion = particles_->motion();
  for (int j = 0; j < half_.n(); ++j) {
    const double inverse = motion.inverse_masses ? motion.inverse_masses[j] : motion.inverse_mass;
    for (int axis = 0; axis < 3; ++axis) a[axis][j] += motion.damping * inverse * v[axis][j];
  }
}

// Drag is part of the kick itself.
void GenericSplittingStepper::kick(std::size_t i, double t, double kinematic_t, double* state) {
  constexpr bool kDrag = false;
  const std::array<double*, 3> v = particles_->layout().axes(state, 3);
  const std::array<double*, 3> a = half_.axes(a_.data());
  ParticleView view = particles_->view(t, state);
  if (midpoint_kicks()) {
    const std::array<double*, 3> v_half = half_.axes(v_half_.data());
    particles_->accelerate(view, a.data(), solver_.has_value());
    if (solver_) add_constraint_forces(view, state + constraint_system_->internal_begin());
    change(plan_.kick.size() + i, v, v_half);
    particles_->prescribed().velocities(kinematic_t, v_half);
    view.vx = v_half[0], view.vy = v_half[1], view.vz = v_half[2];
  }
  if (i > 0 || !known_) particles_->accelerate(view, a.data(), kDrag);
  change(i, v, v);
}

bool GenericSplittingStepper::step(double t, double h, int /*count*/, const double* x,
                                   double* x_next) {
  set_step_size(h);
  const Layout& layout = particles_->layout();
  if (contact_pass_) contact_pass_->begin(t, t + h);
  if (solver_) constraint_system_->refuse({});
  const std::size_t size = particles_->layout().size() + particles_->internal_size() +
                           (constraint_system_ ? constraint_system_->internal_size() : 0);
  std::copy_n(x, size, x_next);
  double start = plan_.drift.front();  // the sum of the drifts so far, in steps
  double constrain_after_kick = 0;     // and the kicks
  lead(t, start * h, x_next);
  drift(t, start * h, x_next);
  particles_->prescribed().velocities(t, layout.axes(x_next, 3));
  for (std::size_t i = 0; i < plan_.kick.size(); ++i) {
    if (particles_->pool().gives_up(0)) return false;
    kick(i, t + start * h, t + (constrain_after_kick + 0.5 * plan_.kick[i]) * h, x_next);
    constrain_after_kick += plan_.kick[i];
    const double d = plan_.drift[i + 1] * h;
    lead(t + start * h, d, x_next);
    if (solver_ && d != 0) {
      if (!constrained_drift(i, t + start * h, d, x_next)) return refuse(x, x_next);
    } else {
      drift(t + start * h, d, x_next);
    }
    start += plan_.drift[i + 1];
    particles_->prescribed().velocities(t + constrain_after_kick * h, layout.axes(x_next, 3));
    if (contact_pass_) resolve(t, h, i, x, x_next);
  }
  known_ = closes_;
  particles_->prescribed().place(t + h, layout.axes(x_next), layout.axes(x_next, 3));
  if (solver_) {
    const ParticleView view = particles_->view(t + h, x_next);
    double* const memory = x_next + constraint_system_->internal_begin();
    if (!solver_->rattle_velocities(t + h, view, layout.axes(x_next), layout.axes(x_next, 3),
                                    memory, weights_.back()))
      return refuse(x, x_next);
    constraint_system_->constraints().follow(view, memory);
    // The projected state is reused by the next step only if no constraint moves, as times would
    // have to agree to the last bit.
    held_ = plan_.kick.front() == plan_.kick.back() && !constraint_system_->constraints().move() &&
            constraint_system_->internal_size() == 0;
  }
  return all_finite({x_next, size}) && (!contact_pass_ || contact_pass_->succeeded());
}

// Without a feasible state in reach the numbers stay finite, so that the reason is reported.
bool GenericSplittingStepper::refuse(const double* x, double* x_next) const {
  const std::size_t size =
      constraint_system_->internal_begin() + constraint_system_->internal_size();
  if (all_finite({x_next, size})) std::copy_n(x, size, x_next);
  constraint_system_->refuse(solver_->refusal());
  return false;
}

// Resolves contacts after kick i and the drift that follows it.
void GenericSplittingStepper::resolve(double t, double h, std::size_t i, const double* x,
                                      double* x_next) {
  const Layout& layout = particles_->layout();
  const bool last = i + 1 == plan_.kick.size();
  const auto q = layout.axes(x_next), v = layout.axes(x_next, 3);
  particles_->pool().run_parts(layout.n(), 16, [&](int begin, int end) {
    if (!contact_inside_) {
      if (last) contact_pass_->end(t, h, layout.axes(x), layout.axes(x, 3), q, v, begin, end);
    } else if (last) {
      RestingContactKick kick;
      for (std::size_t axis = 0; axis < 3; ++axis) kick.q[axis] = q[axis], kick.v[axis] = v[axis];
      contact_pass_->constrain_after_kick(t + h, kick, begin, end);
    } else {
      contact_pass_->resolve_after_drift(t, h, layout.axes(x), layout.axes(x, 3), q, v, begin, end);
    }
  });
}

}  // namespace sim
