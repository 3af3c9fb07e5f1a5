// Whether what forces promise of the ends of steps was kept.
#include "core/base/text.h"
#include "core/particles/particle_system.h"
#include "core/particles/projection.h"
#include "core/study/energy_balance.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

class ProjectionCriterion final : public Criterion {
 public:
  explicit ProjectionCriterion(const Watched& run) : system_(&run.system), balance_(*run.balance) {}

  void look(const Energy* /*energy*/) override {}

  void conclude(Figures& /*figures*/, std::vector<Finding>& findings) override {
    for (Force* const force : particles_of(*system_)->forces()) {
      if (!force->projection()) continue;
      const Projection::Account account = force->projection()->account();
      if (!account.words.empty())
        findings.push_back({account.kept ? Trust::kTrusted : Trust::kSuspect,
                            account.words + ", which with contact took " +
                                brief(balance_.contact().lost, 3) + " J"});
    }
  }

 private:
  Simulation* system_;
  EnergyBalance& balance_;
};

}  // namespace

std::unique_ptr<Criterion> watch_projections(const Watched& run) {
  if (!any_projects(run.system)) return nullptr;
  return std::make_unique<ProjectionCriterion>(run);
}

}  // namespace sim::study
