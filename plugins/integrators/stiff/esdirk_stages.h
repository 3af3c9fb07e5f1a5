// Diagonally implicit stages, each an equation for the system.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "core/base/array.h"
#include "core/ode/implicit/implicit.h"
#include "pair_stages.h"

namespace sim {

// An ESDIRK pair: the first stage is explicit, the others have the same a_ii = gamma, and the last
// is the next state. Error of a step: h sum_i (b_i - embedded_i) k_i.
template <int S>
struct ImplicitPair {
  Tableau<S> method;
  std::array<double, S> embedded;
};

template <int S>
constexpr int embedded_order(const ImplicitPair<S>& pair) {
  Tableau<S> other = pair.method;
  other.b = pair.embedded;
  return order_conditions(other);
}

// The last slope of a step is that of its last stage, from the solved equation: f at a state with
// an error delta has the error lambda delta. Kennedy & Carpenter (2016), NASA/TM-2016-219173.
class EsdirkStages final : public PairStages {
 public:
  template <int S>
  EsdirkStages(const ImplicitPair<S>& pair, int order, const StageOptions& options)
      : plan_(plan_of(pair.method)), options_(options), fixed_(pair.method, order, options) {
    for (int i = 0; i < S; ++i) error_weights_.push_back(pair.method.b[i] - pair.embedded[i]);
  }

  void prepare(OdeSystem& system) override;
  void restart() override { solver_->restart(); }
  StepStatus step(OdeSystem& system, double t, double h, const double* x, const double* slope,
                  double* y, double* error) override;
  void last_slope(OdeSystem& system, double t, double h, const double* y, double* slope) override;
  std::vector<double> memory() const override { return solver_->memory(); }
  bool recall(std::span<const double> memory) override {
    solver_->recall(memory);
    return true;
  }
  Effort effort() const override { return solver_ ? solver_->effort() : Effort{}; }
  std::vector<std::string> notes() const override { return solver_->notes(); }
  double amplification(double h_omega, double h_gamma) const override {
    return fixed_.amplification(h_omega, h_gamma);
  }

 private:
  double gamma() const { return plan_.a_at(1, 1); }
  Stage from(const double* x, double h, const double* slope, const double* weights, int count);

  ExplicitPlan plan_;
  StageOptions options_;
  DiagonallyImplicit fixed_;  // for its amplification
  std::vector<double> error_weights_;
  std::unique_ptr<StageSolver> solver_;
  std::vector<Array> change_;  // gamma h k_i
  Array r_;
  std::vector<Stage::Term> terms_;
};

}  // namespace sim
