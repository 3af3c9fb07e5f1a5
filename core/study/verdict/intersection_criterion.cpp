// Intersections of surfaces with each other or themselves.
#include <algorithm>

#include "core/base/text.h"
#include "core/particles/elements/mesh_intersections.h"
#include "core/particles/particle_system.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

constexpr int kMostCounts = 20;
// Evaluations of one particle that a count of one triangle is worth, so that counts take some 2 %.
constexpr double kCountShare = 100;

class IntersectionCriterion final : public Criterion {
 public:
  explicit IntersectionCriterion(const Watched& run)
      : system_(&run.system),
        crossings_(run.spec.surfaces),
        looks_(run.steps, static_cast<int>(std::clamp(static_cast<double>(run.steps) / kCountShare,
                                                      1.0, double(kMostCounts)))) {
    count();
  }

  void look(const Energy* /*energy*/) override {
    if (looks_.take(system_->step_count())) count();
  }

  void conclude(Figures& figures, std::vector<Finding>& findings) override {
    if (looks_.last() != system_->step_count()) count();
    figures.crossings = most_;
    if (most_ == 0) {
      findings.push_back({Trust::kTrusted, "no surface crosses another or itself"});
      return;
    }
    findings.push_back({Trust::kSuspect, "surfaces cross: up to " + std::to_string(most_) +
                                             (most_ == 1 ? " edge goes" : " edges go") +
                                             " through a triangle, seen from t = " + brief(first_) +
                                             " s on"});
  }

 private:
  void count() {
    if (system_->breaks()) crossings_.tear(system_->torn());
    const auto now =
        crossings_.count(particles_of(*system_)->view(system_->t(), system_->state().data()));
    if (now > 0 && most_ == 0) first_ = system_->t();
    most_ = std::max(most_, now);
  }

  Simulation* system_;
  MeshIntersections crossings_;
  Spread looks_;
  std::int64_t most_ = 0;
  double first_ = 0;  // s
};

}  // namespace

std::unique_ptr<Criterion> watch_crossings(const Watched& run) {
  if (!run.system.second_order() || run.spec.surfaces.empty()) return nullptr;
  return std::make_unique<IntersectionCriterion>(run);
}

}  // namespace sim::study
