#include "core/ode/ode_system.h"

#include <vector>

#include "core/base/array.h"
#include "core/base/finite.h"
#include "core/ode/dense_solver.h"

namespace sim {
namespace {

// Stage after stage with eval() and combine().
class StageByStage final : public Stepper {
 public:
  StageByStage(OdeSystem& system, const ExplicitPlan& plan) : system_(&system), plan_(plan) {
    for (int i = 0; i < plan.stages; ++i) k_.emplace_back(system.size());
    terms_.resize(k_.size());
  }

  bool step(double t, double h, const double* x, double* x_next) override {
    // k_i = f(t + c_i h, x + h sum_{j<i} a_ij k_j); x_next serves as the place of the stage.
    for (int i = 0; i < plan_.stages; ++i) {
      const auto row = static_cast<std::size_t>(i);
      const Stage stage = form(x, h, &plan_.a[row * k_.size()], i);
      system_->eval(t + plan_.c[row] * h, stage, x_next, k_[row].data());
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

}  // namespace

Stage weighted(const double* x, double scale, std::span<const double> weights,
               std::span<const Array> k, std::span<Stage::Term> terms) {
  std::size_t used = 0;
  for (std::size_t j = 0; j < weights.size(); ++j)
    if (weights[j] != 0) terms[used++] = {scale * weights[j], k[j].data()};
  return {x, terms.first(used)};
}

// Eight numbers at a time, whose sums stay in registers while the terms go by.
void combine_range(const Stage& stage, double* out, std::size_t begin, std::size_t end) {
  constexpr std::size_t kLanes = 8;
  const double* const x = stage.x;
  std::size_t i = begin;
  for (; i + kLanes <= end; i += kLanes) {
    double sum[kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane) sum[lane] = x[i + lane];
    for (const auto& [c, k] : stage.terms)
      for (std::size_t lane = 0; lane < kLanes; ++lane) sum[lane] += c * k[i + lane];
    for (std::size_t lane = 0; lane < kLanes; ++lane) out[i + lane] = sum[lane];
  }
  for (; i < end; ++i) {
    double sum = x[i];
    for (const auto& [c, k] : stage.terms) sum += c * k[i];
    out[i] = sum;
  }
}

std::unique_ptr<Stepper> OdeSystem::explicit_stepper(const ExplicitPlan& plan) {
  return std::make_unique<StageByStage>(*this, plan);
}

std::unique_ptr<StageSolver> OdeSystem::stage_solver(const StageOptions& options) {
  return std::make_unique<DenseSolver>(*this, options);
}

}  // namespace sim
