// Springs and ties that broke.
#include "core/base/text.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

class BreakingCriterion final : public Criterion {
 public:
  explicit BreakingCriterion(const Watched& run)
      : system_(&run.system), before_(run.system.settings()) {}

  void look(const Energy* /*energy*/) override {}

  void conclude(Figures& /*figures*/, std::vector<Finding>& findings) override {
    const Settings& now = system_->settings();
    const auto count =
        static_cast<long>(now.broken.size()) - static_cast<long>(before_.broken.size());
    if (count <= 0) return findings.push_back({Trust::kTrusted, "no spring broke"});
    findings.push_back(
        {Trust::kTrusted, std::to_string(count) + (count == 1 ? " spring" : " springs") +
                              " broke, took " +
                              brief(now.broken_energy - before_.broken_energy, 3) + " J"});
  }

 private:
  Simulation* system_;
  Settings before_;
};

}  // namespace

std::unique_ptr<Criterion> watch_breaking(const Watched& run) {
  if (!run.system.breaks()) return nullptr;
  return std::make_unique<BreakingCriterion>(run);
}

}  // namespace sim::study
