// The interface between an embedded pair and a system, which keeps the stages in its own form.
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/ode/explicit/embedded_pair.h"
#include "core/ode/plan.h"

namespace sim {

// Error tolerance: |error_i| <= atol + rtol |x_i| for every number of the state, in each step.
struct Tolerance {
  double atol = 1e-6, rtol = 1e-6;
  double max_step = std::numeric_limits<double>::infinity();  // s
};

// The largest |e_i| / (atol + rtol max(|x_i|, |x_next_i|)) of the estimates of a pair; nan if one
// is not finite.
struct ErrorNorms {
  double fine, coarse;
};

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

  // The norms of h sum_i error_i k_i and h sum_i coarse_i k_i of the step just taken, closed where
  // they need it, if they need not be found from combine(); the coarse one where the pair has one.
  virtual std::optional<ErrorNorms> error_norms(const Tolerance& /*tolerance*/) { return {}; }

  // k_0 := k_S. The next step begins where this one ends.
  virtual void shift() = 0;
};

}  // namespace sim
