// The constraint violation of a run, and the contact forces of constrained particles.
#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/particles/constraints/constraint_system.h"
#include "core/study/accuracy/trajectory.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

constexpr double kMostDrift = 1e-6;  // of the size

class ConstraintCriterion final : public Criterion {
 public:
  explicit ConstraintCriterion(const Watched& run)
      : system_(&run.system), size_(scene_size(run.system)) {}

  void look(const Energy* /*energy*/) override {
    const ConstraintDrift now =
        system_->constraint_system()->drift(system_->t(), system_->state().data());
    drift_.position = std::max(drift_.position, now.position);
    drift_.velocity = std::max(drift_.velocity, now.velocity);
  }

  void conclude(Figures& figures, std::vector<Finding>& findings) override {
    look(nullptr);
    figures.constraints = drift_;
    double most = 0;
    for (const ConstraintForce& each :
         system_->constraint_system()->forces(system_->t(), system_->state().data()))
      most = std::max(most, std::abs(each.tension));
    std::string words = "constraints to " + brief(drift_.position, 2) + " m and " +
                        brief(drift_.velocity, 2) + " m/s, holding with up to " + brief(most, 3) +
                        " N";
    if (const std::int64_t drifts = system_->constraint_system()->implicit_drifts(); drifts > 0)
      words += ", " + std::to_string(drifts) + " drifts implicit, beyond the limit of RATTLE";
    const bool kept = drift_.position <= kMostDrift * size_;
    findings.push_back({kept ? Trust::kTrusted : Trust::kSuspect, words});
  }

 private:
  Simulation* system_;
  double size_;  // m
  ConstraintDrift drift_;
};

}  // namespace

std::unique_ptr<Criterion> watch_constraints(const Watched& run) {
  if (!run.system.constraint_system()) return nullptr;
  return std::make_unique<ConstraintCriterion>(run);
}

}  // namespace sim::study
