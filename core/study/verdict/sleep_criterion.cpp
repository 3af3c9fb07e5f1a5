// Islands that fell asleep, and the energy that this took.
#include "core/base/text.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

class SleepCriterion final : public Criterion {
 public:
  explicit SleepCriterion(const Watched& run)
      : system_(&run.system), taken_before_(run.system.sleep().taken) {}

  void look(const Energy* /*energy*/) override {}

  void conclude(Figures& /*figures*/, std::vector<Finding>& findings) override {
    const SleepAccount now = system_->sleep();
    const std::string all = std::to_string(now.islands);
    std::string words = now.asleep == 0
                            ? "none of " + all + " islands sleeps"
                            : std::to_string(now.asleep) + " of " + all +
                                  (now.islands == 1 ? " island" : " islands") +
                                  " asleep, the last since " + brief(now.since, 4) + " s";
    if (const double taken = now.taken - taken_before_; taken > 0)
      words += ", falling asleep took " + brief(taken, 3) + " J";
    findings.push_back({Trust::kTrusted, words});
  }

 private:
  Simulation* system_;
  double taken_before_;  // J
};

}  // namespace

std::unique_ptr<Criterion> watch_sleep(const Watched& run) {
  if (run.system.sleep().islands == 0) return nullptr;
  return std::make_unique<SleepCriterion>(run);
}

}  // namespace sim::study
