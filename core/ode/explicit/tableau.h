// Butcher tableaus of explicit Runge-Kutta methods.
#pragma once

#include <array>

#include "core/ode/plan.h"

namespace sim {

// y_i = x + h sum_{j<i} a_ij k_j,  k_i = f(t + c_i h, y_i),  x_next = x + h sum_i b_i k_i.
template <int S>
struct Tableau {
  std::array<std::array<double, S>, S> a{};
  std::array<double, S> b{};
  std::array<double, S> c{};
};

template <int S>
ExplicitPlan plan_of(const Tableau<S>& method) {
  ExplicitPlan plan;
  plan.stages = S;
  for (const auto& row : method.a) plan.a.insert(plan.a.end(), row.begin(), row.end());
  plan.b.assign(method.b.begin(), method.b.end());
  plan.c.assign(method.c.begin(), method.c.end());
  return plan;
}

}  // namespace sim
