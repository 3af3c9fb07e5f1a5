#include "local_global_solver.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/particles/springs/springs.h"

namespace sim {

LocalGlobalSolver::LocalGlobalSolver(Particles& system, const StageOptions& options,
                                     std::function<bool()> stopped)
    : system_(&system),
      stopped_(std::move(stopped)),
      iterations_(options.newton_steps),
      equation_(system) {
  if (!system.other_forces().empty())
    throw Error(ErrorKind::kScene,
                {"integrator does not fit", "",
                 "projective dynamics is for springs, gravity and drag, and this system has "
                 "another force, '" +
                     system.name_of(*system.other_forces().front()) + "'",
                 "use implicit_euler"});
  const auto each_spring = [&](const auto& visit) {
    for (const auto& force : system.forces())
      if (const Springs* springs = force->springs()) springs->for_each(visit);
  };
  std::vector<std::array<int, 2>> pairs;
  each_spring([&](int a, int b, double, double) { pairs.push_back({a, b}); });
  row_of_ = elimination_rows(system.masses(), pairs);
  const auto row = [&](int i) { return row_of_[static_cast<std::size_t>(i)]; };
  const auto free = static_cast<int>(row_of_.size()) - system.pinned_count();

  std::vector<std::pair<int, int>> entries;
  for (int i = 0; i < free; ++i) entries.emplace_back(i, i);
  for (const auto& [a, b] : pairs)
    if (row(a) >= 0 && row(b) >= 0)
      entries.emplace_back(std::min(row(a), row(b)), std::max(row(a), row(b)));
  upper_.emplace(free, entries);
  for (int i = 0; i < free; ++i) diagonal_.push_back(upper_->entry(i, i));
  stiffness_.resize(static_cast<std::size_t>(free));
  each_spring([&](int a, int b, double k, double) {
    for (const int end : {row(a), row(b)})
      if (end >= 0) stiffness_[static_cast<std::size_t>(end)] += k;
    const auto [low, high] = std::minmax({row(a), row(b)});
    if (low >= 0) springs_.push_back({upper_->entry(low, high), low, high, k});
  });
  x_.resize(static_cast<std::size_t>(free));
}

void LocalGlobalSolver::factorise(double tau) {
  if (tau == tau_) return;
  tau_ = tau;
  const std::span<double> values = upper_->values();
  std::ranges::fill(values, 0.0);
  const double damping = tau * system_->motion().damping;
  for (std::size_t i = 0; i < row_of_.size(); ++i) {
    if (row_of_[i] < 0) continue;
    const auto row = static_cast<std::size_t>(row_of_[i]);
    values[diagonal_[row]] = system_->masses()[i] + damping + tau * tau * stiffness_[row];
  }
  for (const Spring& spring : springs_) values[spring.entry] -= tau * tau * spring.k;
  if (!x_.empty()) upper_->factorise();
  ++effort_.factorisations;
}

double LocalGlobalSolver::norm() const {
  const auto g = equation_.layout().axes(equation_.gradient().data());
  double sum = 0;
  for (std::size_t i = 0; i < row_of_.size(); ++i)
    if (row_of_[i] >= 0)
      for (int axis = 0; axis < 3; ++axis)
        sum += g[axis][i] * g[axis][i] /
               upper_->values()[diagonal_[static_cast<std::size_t>(row_of_[i])]];
  return std::sqrt(sum);
}

StepStatus LocalGlobalSolver::solve(double t, double tau, const double* r, double* y) {
  factorise(tau);
  equation_.begin(t, tau, r, y);
  const auto g = equation_.layout().axes(equation_.gradient().data());
  const auto d = equation_.layout().axes(equation_.direction().data());
  equation_.evaluate();
  const double first = norm();
  for (int iteration = 0; iteration < iterations_; ++iteration) {
    if (stopped_ && stopped_()) return StepStatus::kStopped;
    for (int axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < row_of_.size(); ++i)
        if (row_of_[i] >= 0) x_[row_of_[i]] = -g[axis][i];
      if (!x_.empty()) upper_->solve(x_);
      for (std::size_t i = 0; i < row_of_.size(); ++i)
        if (row_of_[i] >= 0) d[axis][i] = x_[row_of_[i]];
    }
    equation_.place(1);
    equation_.start_here();
    equation_.evaluate();
    ++effort_.newton;
  }
  const double last = norm();
  if (!std::isfinite(last)) return StepStatus::kNotFinite;
  if (first > 0) effort_.residual = std::max(effort_.residual, last / first);
  return StepStatus::kDone;
}

Effort LocalGlobalSolver::effort() const {
  Effort effort = effort_;
  effort.evaluations = equation_.evaluations();
  return effort;
}

}  // namespace sim
