// Springs, ties and rods that broke.
#include <algorithm>

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
    const long springs = springs_of(now) - springs_of(before_);
    const long rods = rods_of(now) - rods_of(before_);
    const bool has_springs = system_->breakable_springs() > 0;
    if (springs <= 0 && rods <= 0) {
      const bool has_rods = system_->breakable_ties() > system_->breakable_springs();
      return findings.push_back({Trust::kTrusted, !has_rods      ? "no spring broke"
                                                  : !has_springs ? "no rod broke"
                                                                 : "no spring and no rod broke"});
    }
    std::string words;
    if (springs > 0) words = std::to_string(springs) + (springs == 1 ? " spring" : " springs");
    if (springs > 0 && rods > 0) words += " and ";
    if (rods > 0) words += std::to_string(rods) + (rods == 1 ? " rod" : " rods");
    words += " broke";
    const double taken = now.broken_energy - before_.broken_energy;
    if (has_springs || taken != 0) words += ", took " + brief(taken, 3) + " J";
    findings.push_back({Trust::kTrusted, words});
  }

 private:
  // Ties of forces come first.
  long springs_of(const Settings& settings) const {
    const std::vector<int>& broken = settings.broken;
    return std::ranges::lower_bound(broken, system_->breakable_springs()) - broken.begin();
  }
  long rods_of(const Settings& settings) const {
    return static_cast<long>(settings.broken.size()) - springs_of(settings);
  }

  Simulation* system_;
  Settings before_;
};

}  // namespace

std::unique_ptr<Criterion> watch_breaking(const Watched& run) {
  if (!run.system.breaks()) return nullptr;
  return std::make_unique<BreakingCriterion>(run);
}

}  // namespace sim::study
