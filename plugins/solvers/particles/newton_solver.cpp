#include "newton_solver.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

// The forcing term, the relative accuracy of the linear solve: Eisenstat & Walker (1996), SIAM J.
// Sci. Comput. 17(1), choice 2.
double forcing_term(double now, double previous) {
  const double contraction = now / previous;
  return std::min(0.1, 0.9 * contraction * contraction);
}

}  // namespace

NewtonSolver::NewtonSolver(Particles& system, const StageOptions& options,
                           std::function<bool()> stopped, ImplicitContact* contact)
    : system_(&system),
      contact_(contact),
      options_(options),
      equation_(system),
      matrix_(system, std::move(stopped)),
      linear_(make_linear_solver(matrix_, system, options, contact != nullptr)),
      z_(equation_.layout().size()),
      before_(equation_.layout().size()),
      best_(equation_.layout().size()),
      guess_(equation_.layout().size()),
      first_gradient_(equation_.layout().size()),
      lbfgs_(equation_.layout().size()) {
  if (!contact_) return;
  offset_ = Array(equation_.layout().size());
  pulled_ = Array(equation_.layout().size());
}

double NewtonSolver::norm() {
  const double squared = matrix_.precondition(equation_.gradient().data(), z_.data());
  return std::sqrt(std::max(squared, 0.0));
}

double NewtonSolver::goal_from(double first, double tolerance) {
  return std::max(tolerance * first, 4 * matrix_.rounding(equation_.view()));
}

// The error of a step of order p is about the p-th power of the relative change of the
// acceleration.
double NewtonSolver::tolerance() const {
  constexpr double kPart = 1e-3, kLeast = 1e-10;
  if (options_.tolerance > 0) return options_.tolerance;
  const double acceleration_change =
      std::min(1.0, equation_.acceleration_change(guess_, first_gradient_));
  double power = 1;
  for (int i = 0; i < options_.order; ++i) power *= acceleration_change;
  return std::max(kPart * power, kLeast);
}

void NewtonSolver::linearise(double share, bool predicted) {
  const bool clamped = options_.hessian == StageOptions::Hessian::kClamped;
  const auto before = equation_.layout().axes(std::as_const(before_).data());
  matrix_.at(equation_.view(), equation_.tau(), {clamped, share},
             predicted ? before.data() : nullptr);
  matrix_.restrict_to(equation_.bounds());
}

void NewtonSolver::evaluate() {
  equation_.evaluate();
  matrix_.restrict_to(equation_.bounds());
}

LinearResult NewtonSolver::find_direction(double eta) {
  constexpr int kMostCatches = 20;
  LinearResult result = solve_linear(equation_.gradient(), eta);
  if (!equation_.bounds()) return result;
  // Particles that would cross their contact planes are placed onto them, and the system is solved
  // again for the others.
  std::ranges::fill(offset_.span(), 0.0);
  for (int n = 0; n < kMostCatches && result.definite && equation_.activates(offset_); ++n) {
    matrix_.restrict_to(equation_.bounds());
    matrix_.apply(offset_.data(), pulled_.data());
    for (std::size_t i = 0; i < pulled_.size(); ++i) pulled_[i] += equation_.gradient()[i];
    matrix_.project_directions(pulled_.data());
    result = solve_linear(pulled_, eta);
    for (std::size_t i = 0; i < offset_.size(); ++i) equation_.direction()[i] += offset_[i];
  }
  return result;
}

LinearResult NewtonSolver::solve_linear(Array& g, double eta) {
  for (double& value : g.span()) value = -value;
  const LinearResult result = linear_->solve(g.data(), equation_.direction().data(), eta);
  effort_.linear += result.iterations;
  effort_.factorisations += result.factorisations;
  for (double& value : g.span()) value = -value;
  return result;
}

StepStatus NewtonSolver::ended(double first, double last) {
  if (first > 0) effort_.residual = std::max(effort_.residual, last / first);
  return StepStatus::kDone;
}

StepStatus NewtonSolver::solve(double t, double tau, const double* r, double* y) {
  if (contact_) equation_.keep_in(contact_->bounds(t, tau, options_, r));
  equation_.begin(t, tau, r, y);
  evaluate();
  const StepStatus status = options_.newton_steps == 1 ? linearised()
                            : matrix_.symmetric()      ? minimise()
                                                       : reduce();
  if (contact_ && status == StepStatus::kDone) contact_->solved(y);
  return status;
}

// One linearised step without iteration: Baraff & Witkin (1998).
StepStatus NewtonSolver::linearised() {
  const double tolerance = options_.tolerance > 0 ? options_.tolerance : 1e-6;
  linearise(kExact);
  const double first = norm();
  if (!std::isfinite(first)) return StepStatus::kNotFinite;
  if (first <= goal_from(first, tolerance)) return ended(first, first);
  if (!find_direction(tolerance).definite) {
    matrix_.at(equation_.view(), equation_.tau(), {.clamped = true});
    matrix_.restrict_to(equation_.bounds());
    find_definite_direction(tolerance);
  }
  if (matrix_.stopped()) return StepStatus::kStopped;
  ++effort_.newton;
  equation_.place(1);
  evaluate();
  const double last = norm();
  return std::isfinite(last) ? ended(first, last) : StepStatus::kNotFinite;
}

StepStatus NewtonSolver::minimise() {
  constexpr int kSoon = 10;     // steps that are taken whole
  constexpr int kPatience = 5;  // steps that find nothing lower
  constexpr int kHold = 3;      // steps after A was not positive definite
  constexpr int kMany = 40;     // steps that are more than most stages take
  constexpr int kIdle = 100;    // steps that lower Phi by rounding alone
  constexpr int kStalled = 3;   // sure searches without progress: rounding is all there is
  constexpr double kMore = 10, kLess = 0.1, kMost = 1e12;  // changes of the share, and its largest
  constexpr double kSlow = 0.1;     // contraction above which the share grows
  constexpr double kNear = 0.01;    // residual below which a slide is worth its while
  constexpr double kSaddle = 1e-3;  // residual below which a saddle may be near
  double share = kSafe;
  choose_start();
  linearise(share);
  double now = norm(), previous = now, lowest = now;
  const double first = now;
  if (!std::isfinite(now)) return StepStatus::kNotFinite;
  std::ranges::copy(equation_.start().span(), guess_.data());
  std::ranges::copy(equation_.gradient().span(), first_gradient_.data());
  keep_best();
  int since = 0, hold = 0, stalled = 0, idle = 0;
  bool slides = true;
  double settled = best_phi_;  // the lowest before steps that found no more than rounding
  for (int step = 0;; ++step) {
    const double goal = goal_from(first, step > 0 ? tolerance() : options_.tolerance);
    if (now <= goal) break;
    if (step == options_.newton_steps) return StepStatus::kNotConverged;
    ++effort_.newton;

    const bool slow = step > 0 && now > kSlow * previous;
    if (slow && hold <= 0) share = std::min(kMore * share, kMost);
    --hold;
    const bool daring = share > kSafe;
    const bool near = slides && step > 1 && now < kNear * first && !matrix_.restricted();
    const bool sliding = near && slow && linear_->divides_cheaply();
    if (step > 0 && !sliding) linearise(share, true);
    // Long solves are worth more accurate directions.
    const double loosest = step < kMany ? 0.01 : step < 2 * kMany ? 1e-3 : 1e-6;
    const double eta =
        std::max(std::min(loosest, step > 0 ? forcing_term(now, previous) : 0.1), 0.5 * goal / now);
    LinearResult result{.definite = false};
    if (!sliding) result = find_direction(eta);
    double length = 1;
    if (!result.definite && near && can_use_lbfgs()) {
      // A failed L-BFGS solve is followed by a step of the definite model.
      slides = minimise_lbfgs(goal);
      share = kSafe;
      hold = 1;
      length = 0;
    } else if (!result.definite) {
      hold = slides ? kHold : 1;
      slides = true;
      share = std::max(kSafe, kLess * share);
      length = now < kSaddle * first && result.downward ? descend(result.downward) : 0;
      if (length == 0) {
        linearise(kSafe, true);
        find_definite_direction(eta);
        length = 1;
      }
    }
    if (matrix_.stopped()) return StepStatus::kStopped;

    keep_before();
    const double slope = dot(equation_.gradient(), equation_.direction());
    equation_.place(length);
    evaluate();
    if (since == 0 && length != 0 && (daring || step > kSoon)) stretch(length, slope);
    const double phi = equation_.phi();
    previous = now;
    now = norm();
    const bool sound = std::isfinite(now) && std::isfinite(phi);
    const bool lower =
        sound && (phi < best_phi_ - noise_ || (phi <= best_phi_ + noise_ && now < lowest));
    since = lower ? 0 : since + 1;
    if (!sound || since > kPatience) {
      // Returns to the best point and takes a sure descent step from there.
      equation_.start_at(best_);
      evaluate();
      linearise(kSafe);
      const bool fell = search_surely();
      now = norm();
      stalled = fell || now < 0.9 * lowest ? 0 : stalled + 1;
      since = 0;
      share = kSafe;
      hold = kHold;
      keep_before();
    } else if (daring && !lower && now > previous) {
      share = std::max(kSafe, kLess * share);
      hold = kHold;
      now = previous;
      equation_.place(0);
      evaluate();
    }
    equation_.start_here();
    if (since == 0) {
      keep_best();
      lowest = now;
    }
    idle = phi < settled - noise_ ? 0 : idle + 1;
    if (idle == 0) settled = phi;
    if (stalled == kStalled || idle == kIdle) break;
  }
  return ended(first, now);
}

// Chooses the guess, or zero velocities if Phi is lower there. From zero velocities at a state of
// energy E, backward Euler has Phi = E and ends below that. Particles that the user drags keep
// moving.
void NewtonSolver::choose_start() {
  std::ranges::copy(equation_.start().span(), best_.data());
  const double guess = equation_.phi();
  std::ranges::fill(z_.span(), 0.0);
  const ParticleView view = equation_.view();
  const auto rest = equation_.layout().axes(z_.data());
  const auto moving = equation_.layout().axes(std::as_const(best_).data());
  for (int i = 0; i < view.n; ++i)
    for (int axis = 0; axis < 3 && !view.free(i); ++axis) rest[axis][i] = moving[axis][i];
  equation_.start_at(z_);
  if (!(equation_.phi() < guess)) equation_.start_at(best_);
  evaluate();
}

void NewtonSolver::keep_best() {
  best_phi_ = equation_.phi();
  noise_ = equation_.phi_rounding();
  std::ranges::copy(equation_.start().span(), best_.data());
}

void NewtonSolver::keep_before() {
  const ParticleView view = equation_.view();
  const auto before = equation_.layout().axes(before_.data());
  const double* const q[3] = {view.x, view.y, view.z};
  for (int axis = 0; axis < 3; ++axis) std::copy_n(q[axis], view.n, before[axis]);
}

// Rounding errors may make even the definite model fail; then the preconditioned gradient is taken.
void NewtonSolver::find_definite_direction(double eta) {
  if (find_direction(eta).definite) return;
  matrix_.precondition(equation_.gradient().data(), equation_.direction().data());
  for (double& value : equation_.direction().span()) value = -value;
}

// Reduces the residual for forces without a potential Phi. A whole step that rotates stiff springs
// raises the residual and the next one falls below, so that a few whole steps are tried before one
// is shortened.
StepStatus NewtonSolver::reduce() {
  constexpr int kPatience = 4;  // whole steps that find no smaller residual
  constexpr int kMostTurns = 50;
  linearise(kExact);
  double now = norm(), previous = now, lowest = now;
  const double first = now;
  std::ranges::copy(equation_.start().span(), guess_.data());
  std::ranges::copy(equation_.gradient().span(), first_gradient_.data());
  std::ranges::copy(equation_.start().span(), best_.data());
  bool searched = false;
  double eta = 0.1;
  for (int step = 0, turns = 0, since = 0;; ++step) {
    if (!std::isfinite(now)) return StepStatus::kNotFinite;
    const double goal = goal_from(first, step > 0 ? tolerance() : options_.tolerance);
    if (now <= goal) break;
    if (step == options_.newton_steps) return StepStatus::kNotConverged;
    // Directions need more accuracy after a step that had to be shortened.
    if (step > 0) eta = std::min(searched ? 0.1 * eta : 0.1, forcing_term(now, previous));
    eta = std::max(eta, 0.5 * goal / now);
    find_direction(eta);
    if (matrix_.stopped()) return StepStatus::kStopped;
    ++effort_.newton;
    previous = now;
    equation_.place(1);
    evaluate();
    now = norm();
    // A contact that releases its particle may raise the residual.
    searched = !(now <= 0.5 * previous) && !(equation_.turned() && ++turns < kMostTurns);
    since = now < lowest ? 0 : since + 1;
    const bool whole = !equation_.bounds() && std::isfinite(now) && since <= kPatience;
    if (searched && !whole) {
      if (since > 1) {
        equation_.start_at(best_);
        evaluate();
        linearise(kExact);
        now = previous = norm();
        find_direction(std::max(1e-3 * eta, 0.5 * goal / now));
      }
      if (!search_residual(previous)) return StepStatus::kNotConverged;
      since = 0;
    }
    equation_.start_here();
    if (norm() <= goal) continue;
    linearise(kExact);
    now = norm();
    if (since > 0) continue;
    lowest = now;
    std::ranges::copy(equation_.start().span(), best_.data());
  }
  return ended(first, now);
}

Effort NewtonSolver::effort() const {
  Effort effort = effort_;
  effort.evaluations = equation_.evaluations() + matrix_.others().evaluations();
  return effort;
}

std::vector<std::string> NewtonSolver::notes() const {
  std::vector<std::string> list;
  for (const Force* force : matrix_.others().without_blocks())
    list.push_back("force '" + system_->name_of(*force) +
                   "' gives no Jacobian: implicit methods take differences of it, which is slower");
  return list;
}

}  // namespace sim
