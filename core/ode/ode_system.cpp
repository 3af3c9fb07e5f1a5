#include "core/ode/ode_system.h"

#include <vector>

#include "core/base/array.h"
#include "core/base/error.h"
#include "core/base/finite.h"
#include "core/ode/implicit/dense_solver.h"
#include "core/ode/implicit/krylov_solver.h"
#include "core/ode/implicit/linearisation.h"

namespace sim {
namespace {

// An explicit Runge-Kutta method, stage after stage with eval() and combine().
class StageByStage final : public Stepper {
 public:
  StageByStage(OdeSystem& system, const ExplicitPlan& plan) : system_(&system), plan_(plan) {
    for (int i = 0; i < plan.stages; ++i) k_.emplace_back(system.size());
    terms_.resize(k_.size());
  }

  bool step(double t, double h, int /*count*/, const double* x, double* x_next) override {
    // k_i = f(t + c_i h, x + h sum_{j<i} a_ij k_j); x_next holds the state of the stage.
    for (int i = 0; i < plan_.stages; ++i) {
      const auto row = static_cast<std::size_t>(i);
      const Stage stage = form(x, h, &plan_.a[row * k_.size()], i);
      system_->eval(t + plan_.c[row] * h, stage, x_next, k_[row].data());
      if (system_->cancellation().gives_up()) return false;
    }
    system_->combine(form(x, h, plan_.b.data(), plan_.stages), x_next);
    return all_finite({x_next, system_->size()});
  }

 private:
  Stage form(const double* x, double h, const double* weights, int count) {
    return weighted(x, h, {weights, static_cast<std::size_t>(count)}, k_, terms_);
  }

  OdeSystem* system_;
  ExplicitPlan plan_;
  std::vector<Array> k_;
  std::vector<Stage::Term> terms_;
};

// The stages of an embedded pair, likewise, each as long as X.
class StagesOfPair final : public EmbeddedStepper {
 public:
  StagesOfPair(OdeSystem& system, const EmbeddedPlan& plan)
      : system_(&system), plan_(plan), y_(system.size()), terms_(plan.c.size()) {
    for (std::size_t i = 0; i < plan.c.size(); ++i) k_.emplace_back(system.size());
  }

  bool start(double t, const double* x) override { return derivative(t, {x, {}}, k_.front()); }

  bool step(double t, double h, const double* x, double* x_next) override {
    for (int i = 1; i < plan_.stages; ++i) evaluate(t, h, x, i);
    system_->combine(weighted(x, h, plan_.method.b, k_, terms_), x_next);
    return all_finite({x_next, system_->size()});
  }

  bool close(double t, const double* x) override { return derivative(t, {x, {}}, end()); }

  void extend(double t, double h, const double* x) override {
    for (int i = plan_.stages + 1; i < static_cast<int>(k_.size()); ++i) evaluate(t, h, x, i);
  }

  void combine(const double* /*x*/, double h, std::span<const double> weights, const double* base,
               double* out) override {
    system_->combine(weighted(base, h, weights, k_, terms_), out);
  }

  void shift() override { std::swap(k_.front(), end()); }

 private:
  Array& end() { return k_[static_cast<std::size_t>(plan_.stages)]; }

  bool derivative(double t, const Stage& stage, Array& k) {
    system_->eval(t, stage, y_.data(), k.data());
    return all_finite(k.span());
  }
  void evaluate(double t, double h, const double* x, int stage) {
    const auto i = static_cast<std::size_t>(stage);
    derivative(t + plan_.c[i] * h, weighted(x, h, plan_.a[i], k_, terms_), k_[i]);
  }

  OdeSystem* system_;
  EmbeddedPlan plan_;
  Array y_;
  std::vector<Array> k_;
  std::vector<Stage::Term> terms_;
};

}  // namespace

Stage weighted(const double* x, double scale, std::span<const double> weights,
               std::span<const Array> k, std::span<Stage::Term> terms) {
  std::size_t used = 0;
  for (std::size_t j = 0; j < weights.size(); ++j)
    if (weights[j] != 0) terms[used++] = {scale * weights[j], k[j].data()};
  return {x, terms.first(used)};
}

std::unique_ptr<Stepper> OdeSystem::explicit_stepper(const ExplicitPlan& plan) {
  if (plan.precision == Precision::kSingle)
    throw Error(ErrorKind::kScene,
                {"single precision does not fit", "",
                 "it is for particles under springs, gravity and drag", "use double"});
  return std::make_unique<StageByStage>(*this, plan);
}

std::unique_ptr<EmbeddedStepper> OdeSystem::embedded_stepper(const EmbeddedPlan& plan) {
  return std::make_unique<StagesOfPair>(*this, plan);
}

std::unique_ptr<LinearisedSolver> OdeSystem::linearised_solver() {
  constexpr std::size_t kFewNumbers = 100;  // two evaluations of f for each
  if (size() > kFewNumbers || has_inequalities()) return nullptr;
  return make_linearised_solver(all_entries(*this));
}

std::unique_ptr<StageSolver> OdeSystem::stage_solver(const StageOptions& options) {
  // Inequalities make J full, but stiff only where they bend, so that few products are needed.
  constexpr std::size_t kMostDense = 600;
  const bool many = size() > kMostDense, asked = options.solver == StageOptions::Solver::kIterative;
  if (has_inequalities() ? !many && !asked : !many || !asked)
    return std::make_unique<DenseSolver>(*this, options);
  return std::make_unique<KrylovSolver>(*this, options);
}

}  // namespace sim
