// What colliders did.
#include <algorithm>

#include "core/base/text.h"
#include "core/particles/particle_system.h"
#include "core/particles/rigid/rigid_contact.h"
#include "core/study/energy_balance.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

class ContactCriterion final : public Criterion {
 public:
  explicit ContactCriterion(const Watched& run) : system_(&run.system), balance_(*run.balance) {}

  void look(const Energy* /*energy*/) override {}

  void conclude(Figures& /*figures*/, std::vector<Finding>& findings) override {
    const ParticleSystem& particles = *particles_of(*system_);
    const ParticleView view = particles.view(system_->t(), system_->state().data());
    int touched = 0;
    double deepest = 0;
    const bool collides = !particles.contacts().empty();  // bodies may touch each other alone
    for (int i = 0; collides && i < view.n; ++i) {
      if (!particles.contacts().ledger().touched(i)) continue;
      ++touched;
      for (const auto& collider : particles.contacts().all())
        deepest = std::max(deepest, -collider->touch(view.t, view.position(i)).gap);
    }
    const RigidContact* const contact = system_->rigid_contact();
    if (contact) bodies(*contact, findings);
    if (touched == 0) {
      if (!contact) findings.push_back({Trust::kTrusted, "contact: none"});
      return;
    }
    const ContactWork work = balance_.contact();
    std::string words = "contact: " + std::to_string(touched) +
                        (touched == 1 ? " particle" : " particles") + ", deepest " +
                        brief(deepest, 2) + " m";
    if (!any_projects(*system_)) words += ", took " + brief(work.lost, 3) + " J";
    if (particles.contacts().move()) words += ", colliders did " + brief(work.given, 3) + " J";
    if (const std::int64_t uncut = particles.contacts().ledger().uncut(); uncut > 0)
      words += ", " + std::to_string(uncut) + " steps with too many touches to be cut at each";
    findings.push_back({Trust::kTrusted, words});
  }

 private:
  void bodies(const RigidContact& contact, std::vector<Finding>& findings) {
    const RigidContact::Counts& counts = contact.counts();
    if (counts.most == 0) return findings.push_back({Trust::kTrusted, "bodies touched nothing"});
    findings.push_back({Trust::kTrusted, "bodies touched at up to " + std::to_string(counts.most) +
                                             " points, took " + brief(balance_.contact().lost, 3) +
                                             " J"});
    // What the solver left where it did not get to its end.
    constexpr double kSaid = 1e-6, kDoubted = 1e-3;
    if (counts.unsettled > kSaid * counts.fastest)
      findings.push_back(
          {counts.unsettled > kDoubted * counts.fastest ? Trust::kSuspect : Trust::kTrusted,
           "impulses between bodies to " + brief(counts.unsettled, 2) + " m/s"});
  }

  Simulation* system_;
  EnergyBalance& balance_;
};

}  // namespace

std::unique_ptr<Criterion> watch_contact(const Watched& run) {
  if (!run.system.second_order()) return nullptr;
  if (particles_of(run.system)->contacts().empty() && !run.system.rigid_contact()) return nullptr;
  return std::make_unique<ContactCriterion>(run);
}

}  // namespace sim::study
