// The interface between an embedded pair and a system, which keeps the stages in its own form.
#pragma once

#include <span>
#include <vector>

#include "core/ode/explicit/embedded_pair.h"
#include "core/ode/plan.h"

namespace sim {

// An EmbeddedPair at run time; a row of weights has one for every stage.
struct EmbeddedPlan {
  using Row = std::vector<double>;

  template <int S, int X, int D>
  explicit EmbeddedPlan(const EmbeddedPair<S, X, D>& pair)
      : stages(S), method(plan_of(pair.method)) {
    const auto all = order::all_stages(pair);
    c.assign(all.c.begin(), all.c.end());
    for (const auto& row : all.a) a.emplace_back(row.begin(), row.end());
    error.assign(pair.error.begin(), pair.error.end());
    if (pair.coarse != decltype(pair.coarse){})
      coarse.assign(pair.coarse.begin(), pair.coarse.end());
    for (const auto& row : pair.dense) dense.emplace_back(row.begin(), row.end());
  }

  int stages;  // without f(t + h, x_next), which stands behind them, and those of dense output
  ExplicitPlan method;
  Row c, error, coarse;
  std::vector<Row> a, dense;
};

// The stages of one step after the other: k_0 .. k_(S-1) of the method, k_S = f(t + h, x_next), and
// then those of dense output. A pair prepared for one system; it owns all their memory.
class EmbeddedStepper {
 public:
  virtual ~EmbeddedStepper() = default;

  // k_0 := f(t, x). False if a number of it is not finite.
  virtual bool start(double t, const double* x) = 0;

  // k_1 .. k_(S-1) and x_next, from k_0. False if a number of x_next is not finite.
  virtual bool step(double t, double h, const double* x, double* x_next) = 0;

  // k_S := f(t, x) at the end of the step. False if a number of it is not finite.
  virtual bool close(double t, const double* x) = 0;

  // Computes the stages of dense output of the step from x, which is closed.
  virtual void extend(double t, double h, const double* x) = 0;

  // out := base + h sum_i weights_i k_i, of the step of size h from x; of k_0 alone for any h.
  virtual void combine(const double* x, double h, std::span<const double> weights,
                       const double* base, double* out) = 0;

  // k_0 := k_S. The next step begins where this one ends.
  virtual void shift() = 0;
};

}  // namespace sim
