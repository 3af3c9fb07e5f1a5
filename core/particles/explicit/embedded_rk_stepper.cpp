#include "core/particles/explicit/embedded_rk_stepper.h"

#include <algorithm>

#include "core/base/finite.h"

namespace sim {
namespace {

std::vector<Array> accelerations(const Particles& system, const EmbeddedPlan& plan) {
  std::vector<Array> arrays;
  for (std::size_t i = 0; i < plan.c.size(); ++i)
    arrays.emplace_back(Layout(system.layout().n(), 3).size());
  return arrays;
}

}  // namespace

EmbeddedRkStepper::EmbeddedRkStepper(Particles& system, const EmbeddedPlan& plan)
    : system_(&system),
      plan_(plan),
      a_(accelerations(system, plan)),
      stepper_(system, plan.method, a_),
      of_acceleration_(a_.size()),
      q_terms_(a_.size() + 1),
      v_terms_(a_.size()) {
  if (static_cast<int>(a_.size()) > plan.stages + 1) y_ = Array(system.layout().size());
}

void EmbeddedRkStepper::extend(double t, double h, const double* x) {
  for (int i = plan_.stages + 1; i < static_cast<int>(a_.size()); ++i) {
    const auto row = static_cast<std::size_t>(i);
    combine(x, h, plan_.a[row], x, y_.data());
    evaluate(t + plan_.c[row] * h, y_.data(), i);
  }
}

void EmbeddedRkStepper::combine(const double* x, double h, std::span<const double> weights,
                                const double* base, double* out) {
  const Layout half(system_->layout().n(), 3);
  double of_velocity = 0;
  std::fill(of_acceleration_.begin(), of_acceleration_.end(), 0.0);
  std::size_t v_count = 0, q_count = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] == 0) continue;
    v_terms_[v_count++] = {h * weights[i], a_[i].data()};
    of_velocity += weights[i];
    for (std::size_t j = 0; j < i; ++j) of_acceleration_[j] += weights[i] * plan_.a[i][j];
  }
  q_terms_[q_count++] = {h * of_velocity, x + half.size()};
  for (std::size_t j = 0; j < a_.size(); ++j)
    if (of_acceleration_[j] != 0) q_terms_[q_count++] = {h * h * of_acceleration_[j], a_[j].data()};

  // The first half of a state holds the positions, the second the velocities.
  const Stage q{base, std::span(q_terms_).first(q_count)};
  const Stage v{base + half.size(), std::span(v_terms_).first(v_count)};
  system_->for_ranges(3, [&](std::size_t begin, std::size_t end) {
    combine_range_(q, out, begin, end);
    combine_range_(v, out + half.size(), begin, end);
  });
}

void EmbeddedRkStepper::shift() {
  const Array& end = a_[static_cast<std::size_t>(plan_.stages)];
  std::copy_n(end.data(), end.size(), a_.front().data());
}

bool EmbeddedRkStepper::evaluate(double t, const double* x, int i) {
  const Layout half(system_->layout().n(), 3);
  Array& k = a_[static_cast<std::size_t>(i)];
  double* const a[3] = {half.block(k.data(), 0), half.block(k.data(), 1), half.block(k.data(), 2)};
  system_->accelerate(system_->view(t, x), a);
  return all_finite(k.span()) && all_finite({x + half.size(), half.size()});
}

}  // namespace sim
