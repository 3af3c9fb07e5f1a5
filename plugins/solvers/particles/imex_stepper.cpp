#include "imex_stepper.h"

#include <algorithm>
#include <cmath>

#include "core/base/finite.h"
#include "core/base/text.h"
#include "core/math/axes.h"
#include "core/math/exponential.h"

namespace sim {
namespace {

constexpr int kFewStiff = 2048;    // particles of a stage that one thread solves
constexpr double kRinging = 100;   // omega times a part of a stage, as far as springs may fold
constexpr int kMostSubsteps = 64;  // of a stage
constexpr double kNoCut = -1;      // no spring is stiff

// The factorisation is cheaper than conjugate gradients if it is nearly as sparse as the graph.
bool factor_is_sparse(const Particles& system) {
  constexpr double kWorth = 2700;  // products, for each spring
  std::vector<std::array<int, 2>> pairs;
  for (const Force* const force : system.forces())
    if (const Springs* const springs = force->springs())
      springs->for_each([&](int a, int b, double, double) { pairs.push_back({a, b}); });
  return factor_products(elimination_rows(system.masses(), pairs), pairs) <=
         kWorth * static_cast<double>(pairs.size());
}

}  // namespace

ImexStepper::ImexStepper(OdeSystem& system, Particles& particles, StiffPart::Said said,
                         ImplicitContact* contact, const ImplicitExplicitPlan& plan)
    : system_(&system),
      particles_(&particles),
      contact_(contact),
      plan_(plan),
      parts_(particles, std::move(said)),
      half_(particles.layout().n(), 3),
      one_(particles.layout().n(), 1) {}

void ImexStepper::choose_partition(double t, double h, const double* x) {
  make(parts_.choose(t, h, x), x);
}

// Kicks by a constant g around implicit midpoint are implicit midpoint with g:
//   v_mid = (v + h/2 g) + h/2 a(q + h/2 v_mid),  v_next = 2 v_mid - (v + h/2 g) + h/2 g
bool ImexStepper::is_all_stiff() const {
  return soft_ && soft_->motion().damping == 0 && !soft_->has_other_forces() &&
         soft_->runs().empty() && soft_->internal_size() == 0;
}

// The numbers of a checkpoint are finite: an infinite cut is stored as kNoCut.
std::vector<double> ImexStepper::memory() const {
  if (partition_.step == 0) return {};
  std::vector<double> numbers{partition_.step,
                              std::isfinite(partition_.cut) ? partition_.cut : kNoCut};
  numbers.insert(numbers.end(), partition_.others.begin(), partition_.others.end());
  return numbers;
}

bool ImexStepper::recall(std::span<const double> memory) {
  if (memory.size() != 2 + particles_->forces().size() || !(memory[0] > 0) ||
      !(memory[1] >= 0 || memory[1] == kNoCut))
    return false;
  const double cut = memory[1] == kNoCut ? HUGE_VAL : memory[1];
  Partition said{.step = memory[0], .cut = cut, .others = {}};
  for (const double stiff : memory.subspan(2)) said.others.push_back(stiff != 0);
  for (std::size_t i = 0; i < said.others.size(); ++i)
    if (said.others[i] && !particles_->forces()[i]->accumulates()) return false;
  const std::vector<double> zeros(system_->size());
  if (said != partition_) make(said, zeros.data());
  return true;
}

void ImexStepper::make(const Partition& partition, const double* x) {
  past_ = effort();
  steps_ = evaluations_ = 0;
  partition_ = partition;
  count_ = parts_.count(partition);
  verlet_.reset();
  springs_.reset();
  solver_.reset();
  soft_.reset();
  stiff_.reset();
  ids_.clear();
  h_ = 0;
  known_ = false;
  if (count_.none()) {
    verlet_ = system_->split_stepper(plan_.soft);
    return;
  }
  soft_ = parts_.soft_system(partition, x);
  if (!contact_) ids_ = parts_.stiff_particles(partition);
  count_.particles = ids_.empty() ? particles_->layout().n() : static_cast<int>(ids_.size());
  ThreadPool* pool = &particles_->pool();
  if (count_.particles < kFewStiff) {
    own_pool_ = std::make_unique<ThreadPool>(1);
    pool = own_pool_.get();
  }
  stiff_ = parts_.stiff_system(partition, ids_, x, *pool);
  make_solver();
  a_ = Array(half_.size());
  if (soft_->needs_velocities()) v_half_ = Array(half_.size());
  r_ = Array(stiff_->layout().size());
  y_ = Array(stiff_->layout().size());
  for (Array* array : {&keeps_[0], &keeps_[1], &gains_[0], &gains_[1]}) *array = Array(one_.size());
  internal_.emplace(*soft_);
}

// The midpoint rule is left where there is contact, another force than springs, or a graph that
// fills up: it preserves lengths at the middle of its steps. At the ends they oscillate, the more
// the stiffer a rotating spring is, and take energy from the motion: a stage is divided into
// substeps.
void ImexStepper::make_solver() {
  const auto stopped = [this] { return system_->stopped(); };
  substeps_ = std::max(1, plan_.substeps);
  if (!contact_ && stiff_->other_forces().empty() && factor_is_sparse(*stiff_)) {
    springs_ = std::make_unique<DiscreteGradientSolver>(*stiff_, plan_.stiff.tolerance, stopped);
    return;
  }
  solver_ = std::make_unique<NewtonSolver>(*stiff_, plan_.stiff, stopped, contact_);
  if (plan_.substeps == 0 && !contact_) {
    const double ringing = partition_.step * count_.fastest_stiff / kRinging;
    substeps_ = std::clamp(static_cast<int>(std::ceil(ringing)), 1, kMostSubsteps);
  }
}

void ImexStepper::restart() {
  known_ = false;
  if (verlet_) verlet_->restart();
}

Advance ImexStepper::advance(double t, double h, std::int64_t most, const double* x,
                             double* x_next) {
  if (verlet_) {
    const int count = verlet_->most_of(most);
    const bool finite = verlet_->step(t, h, count, x, x_next);
    if (system_->gave_up()) {
      verlet_->restart();
      return {StepStatus::kStopped};
    }
    if (finite) {
      steps_ += count;
      evaluations_ += verlet_->midpoint_kicks() ? 2 * count * std::ssize(plan_.soft.kick) : count;
      return {StepStatus::kDone, count};
    }
    if (count == 1) return {StepStatus::kNotFinite, 0};
    verlet_->restart();
    return advance(t, h, 1, x, x_next);
  }
  set_step_size(h);
  for (bool again = false;; again = true) {
    const StepStatus status = step(t, h, system_->begin_step(t, h, x, again), x_next);
    if (status != StepStatus::kDone) return {status, 0};
    const StepEnd end = system_->end_step(t, h, x, x_next);
    if (end == StepEnd::kAccepted) break;
    if (end == StepEnd::kNotAllowed) return {StepStatus::kNotConverged, 0};
  }
  known_ = !soft_->needs_velocities() && particles_->contacts().empty();
  ++steps_;
  return {StepStatus::kDone, 1};
}

StepStatus ImexStepper::step(double t, double h, const double* x, double* x_next) {
  const Layout& layout = particles_->layout();
  std::copy_n(x, system_->size(), x_next);
  const auto v = layout.axes(x_next, 3);
  particles_->prescribed().velocities(t, v);
  kick(t, x_next, true);
  particles_->prescribed().chords(t, h, layout.axes(x_next), v);
  const StepStatus status = drift(t, h, x_next);
  if (status != StepStatus::kDone) return status;
  particles_->prescribed().velocities(t + h, v);
  kick(t + h, x_next, false);
  return all_finite({x_next, system_->size()}) ? StepStatus::kDone : StepStatus::kNotFinite;
}

// Kicks of h/2, and their first halves for forces that depend on velocity.
void ImexStepper::set_step_size(double h) {
  if (h == h_) return;
  h_ = h;
  known_ = false;
  const Motion& motion = soft_->motion();
  for (std::size_t slot = 0; slot < 2; ++slot) {
    double* const keeps = one_.block(keeps_[slot].data(), 0);
    double* const gains = one_.block(gains_[slot].data(), 0);
    for (int i = 0; i < one_.n(); ++i) {
      const double inverse = motion.inverse_masses ? motion.inverse_masses[i] : motion.inverse_mass;
      const Damping own = damping(motion.damping * inverse, (slot == 0 ? 0.5 : 0.25) * h);
      keeps[i] = own.keep;
      gains[i] = own.gain;
    }
  }
}

void ImexStepper::change(std::size_t slot, const double* const v[3], double* const to[3]) {
  const auto a = half_.axes(std::as_const(a_).data());
  const double* const keeps = one_.block(std::as_const(keeps_[slot]).data(), 0);
  const double* const gains = one_.block(std::as_const(gains_[slot]).data(), 0);
  soft_->pool().run_parts(half_.n(), 8, [&](int begin, int end) {
    for (int axis = 0; axis < 3; ++axis)
      for (int i = begin; i < end; ++i) to[axis][i] = keeps[i] * v[axis][i] + gains[i] * a[axis][i];
  });
}

void ImexStepper::kick(double t, double* state, bool first) {
  constexpr bool kDrag = false;
  const auto v = particles_->layout().axes(state, 3);
  const double* const now[3] = {v[0], v[1], v[2]};
  const auto a = half_.axes(a_.data());
  ParticleView view = soft_->view(t, state);
  if (soft_->needs_velocities()) {
    const auto v_half = half_.axes(v_half_.data());
    soft_->accelerate(view, a.data(), kDrag);
    change(1, now, v_half.data());
    view.vx = v_half[0], view.vy = v_half[1], view.vz = v_half[2];
    ++evaluations_;
  }
  if (!first || !known_) {
    soft_->accelerate(view, a.data(), kDrag);
    ++evaluations_;
  }
  change(0, now, v.data());
}

// A step that keeps the energy of stiff springs, or implicit midpoint from (q, v):
//   v_mid = v + h/2 a_stiff(q + h/2 v_mid),  q + h v_mid,  2 v_mid - v
// Particles without stiff forces drift.
StepStatus ImexStepper::drift(double t, double h, double* state) {
  const Layout& layout = particles_->layout();
  const Layout& few = stiff_->layout();
  const auto q = layout.axes(state), v = layout.axes(state, 3);
  const auto r_q = few.axes(r_.data()), r_v = few.axes(r_.data(), 3);
  const auto v_mid = few.axes(y_.data(), 3);
  const auto id = [&](int i) { return ids_.empty() ? i : ids_[static_cast<std::size_t>(i)]; };
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < few.n(); ++i) {
      r_q[axis][i] = q[axis][id(i)];
      r_v[axis][i] = v_mid[axis][i] = v[axis][id(i)];
    }
  const double part = h / substeps_;
  for (int k = 0; k < substeps_; ++k) {
    const StepStatus status =
        springs_ ? springs_->step(part, r_.data())
                 : solver_->solve(t + (k + 0.5) * part, 0.5 * part, r_.data(), y_.data());
    if (status != StepStatus::kDone) return status;
    for (int axis = 0; axis < 3 && !springs_; ++axis)
      for (int i = 0; i < few.n(); ++i) {
        r_q[axis][i] += part * v_mid[axis][i];
        r_v[axis][i] = 2 * v_mid[axis][i] - r_v[axis][i];
      }
  }
  if (!ids_.empty())
    particles_->pool().run_parts(layout.n(), 8, [&](int begin, int end) {
      for (int axis = 0; axis < 3; ++axis)
        for (int i = begin; i < end; ++i) q[axis][i] += h * v[axis][i];
    });
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < few.n(); ++i) {
      q[axis][id(i)] = r_q[axis][i];
      v[axis][id(i)] = r_v[axis][i];
    }
  internal_->drift(t, h, state);
  return StepStatus::kDone;
}

Effort ImexStepper::effort() const {
  Effort effort = past_;
  if (springs_ || solver_) {
    Effort stages = springs_ ? springs_->effort() : solver_->effort();
    stages.evaluations = 0;  // of the stiff part alone
    effort += stages;
  }
  return effort + Effort{.steps = steps_, .evaluations = evaluations_};
}

std::vector<std::string> ImexStepper::notes() const {
  if (partition_.step == 0) return {};
  if (verlet_)
    return {"imex: nothing is stiff for steps of " + brief(partition_.step, 3) +
            " s: the steps of verlet"};
  std::string what;
  if (count_.stiff_springs > 0)
    what =
        std::to_string(count_.stiff_springs) + " of " + std::to_string(count_.springs) + " springs";
  for (std::size_t i = 0; i < partition_.others.size(); ++i)
    if (partition_.others[i])
      what += (what.empty() ? "'" : " and '") + particles_->name_of(*particles_->forces()[i]) + "'";
  std::string why;
  if (count_.fastest_stiff > 0)
    why = ": each up to " + brief(count_.fastest_stiff, 3) +
          " rad/s, explicit steps would be below " + brief(2 / count_.fastest_stiff, 2) + " s";
  std::vector<std::string> notes{"imex: " + what + " on " + std::to_string(count_.particles) +
                                 " of " + std::to_string(particles_->layout().n()) +
                                 " particles are implicit in steps of " +
                                 brief(partition_.step, 3) + " s" + why};
  if (solver_)
    for (const std::string& note : solver_->notes()) notes.push_back(note);
  return notes;
}

}  // namespace sim
