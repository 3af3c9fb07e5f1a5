// The state itself: its error against the exact solution, and the stretch of its springs.
#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

constexpr int kMostStrains = 12;
constexpr double kEvaluationsPerStrain = 130;  // so that looks at strain cost about 1 %

class ExactCriterion final : public Criterion {
 public:
  explicit ExactCriterion(const Watched& run) : spec_(&run.spec), system_(&run.system) {}

  void look(const Energy* /*energy*/) override {
    const Deviation now = deviation(*spec_, *system_);
    // A comparison with nan is false: not-a-number counts as an infinite error.
    error_ = now.error <= error_ ? error_ : std::isnan(now.error) ? INFINITY : now.error;
    size_ = std::max(size_, now.size);
  }

  void conclude(Figures& /*figures*/, std::vector<Finding>& findings) override {
    findings.push_back(
        {!(error_ <= kTolerance * size_) ? Trust::kSuspect : Trust::kTrusted,
         "largest error " + brief(error_, 3) + " of a solution of size " + brief(size_, 3)});
  }

 private:
  const SystemSpec* spec_;
  Simulation* system_;
  double error_ = 0, size_ = 0;  // largest seen
};

class StrainCriterion final : public Criterion {
 public:
  explicit StrainCriterion(const Watched& run)
      : system_(&run.system),
        looks_(run.steps, static_cast<int>(
                              std::clamp(static_cast<double>(run.steps) *
                                             std::max(1, run.system.integrator_info().evaluations) /
                                             kEvaluationsPerStrain,
                                         1.0, double(kMostStrains)))) {}

  void look(const Energy* /*energy*/) override {
    if (looks_.take(system_->step_count())) measure();
  }

  void conclude(Figures& figures, std::vector<Finding>& findings) override {
    if (looks_.last() != system_->step_count()) measure();
    StrainedSpring& worst = figures.strain;  // of states in between, where there were any
    if (worst_.a >= 0 && !(std::abs(worst_.strain) <= std::abs(worst.strain))) worst = worst_;
    if (worst.a >= 0)
      findings.push_back({Trust::kTrusted, "strain " + percent(worst.strain, 1, 2)});
  }

 private:
  void measure() {
    const StrainedSpring worst = worst_spring(*system_);
    if (worst.a >= 0 && !(std::abs(worst.strain) <= std::abs(worst_.strain))) worst_ = worst;
  }

  Simulation* system_;
  Spread looks_;
  StrainedSpring worst_;
};

}  // namespace

std::unique_ptr<Criterion> watch_exact(const Watched& run) {
  if (!run.spec.exact) return nullptr;
  return std::make_unique<ExactCriterion>(run);
}

std::unique_ptr<Criterion> watch_strain(const Watched& run) {
  if (!run.system.second_order()) return nullptr;
  return std::make_unique<StrainCriterion>(run);
}

}  // namespace sim::study
