// Contact with colliders, and the corrections that change the ends of steps.
#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/particles/particle_system.h"
#include "core/particles/step_correction.h"
#include "core/particles/step_path.h"
#include "core/study/energy_balance.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

class ContactCriterion final : public Criterion {
 public:
  explicit ContactCriterion(const Watched& run)
      : system_(&run.system),
        balance_(*run.balance),
        elastic_(!run.spec.bodies.empty() && !run.spec.contact &&
                 std::ranges::all_of(run.spec.bodies, [](const RigidSpec& body) {
                   return !body.touches || (body.surface.restitution == 1 &&
                                            body.surface.friction == 0 && !body.surface.law);
                 })) {}

  void look(const Energy* /*energy*/) override {
    if (!particles_of(*system_)->contacts().sampled()) measure();
  }

  // Their dissipation is one figure, which the last of those that acted reports.
  void conclude(Figures& /*figures*/, std::vector<Finding>& findings) override {
    std::vector<std::size_t> acted;
    for (const auto& correction : system_->corrections()) {
      const StepCorrection::Account account = correction->account();
      if (account.words.empty()) continue;
      if (account.acted) acted.push_back(findings.size());
      findings.push_back({account.kept ? Trust::kTrusted : Trust::kSuspect, account.words});
    }
    if (const std::string words = colliders(); !words.empty()) {
      acted.push_back(findings.size());
      findings.push_back({Trust::kTrusted, words});
    } else if (system_->corrections().empty()) {
      findings.push_back({Trust::kTrusted, "contact: none"});
    }
    if (excess_ > 1)
      findings.push_back({Trust::kSuspect, "particle " + std::to_string(sunk_) + " was " +
                                               brief(sunk_by_, 2) + " m inside a collider"});
    if (acted.empty()) return;
    const ContactWork work = balance_.contact();
    std::string& words = findings[acted.back()].words;
    words += (acted.size() > 1 ? ", together took " : ", took ") + brief(work.lost, 3) + " J";
    if (particles_of(*system_)->contacts().move())
      words += ", colliders did " + brief(work.given, 3) + " J";
    constexpr double kShare = 1e-3;      // of the energy in play
    constexpr double kRounding = 1e-10;  // of all energy
    const Energy now = system_->energy();
    const double share = kShare * balance_.in_play() +
                         kRounding * (now.kinetic + std::fabs(now.potential));
    if (-work.lost > share)
      findings.push_back({Trust::kSuspect, "contact, which can only take energy, gave " +
                                               brief(-work.lost, 3) + " J, " +
                                               percent(-work.lost, balance_.in_play()) +
                                               " of the energy in play"});
    // Without friction, with a restitution of 1, contact of bodies takes no energy.
    if (elastic_ && work.lost > share)
      findings.push_back({Trust::kSuspect,
                          "elastic contact without friction took " + brief(work.lost, 3) + " J, " +
                              percent(work.lost, balance_.in_play()) + " of the energy in play"});
  }

 private:
  struct Penetration {
    int particles = 0;
    double deepest = 0;  // m
  };
  // Measures the present state, and keeps the worst of all so far.
  Penetration measure() {
    constexpr double kDeep = 1e-5;  // in units of the place: a penetration that is no rounding
    const ParticleSystem& particles = *particles_of(*system_);
    const Contacts& contacts = particles.contacts();
    const ParticleView view = particles.view(system_->t(), system_->state().data());
    Penetration now;
    for (int i = 0; !contacts.empty() && i < view.n; ++i) {
      if (!contacts.work_sums().touched(i)) continue;
      ++now.particles;
      const Vec3 place = view.position(i);
      double depth = 0;
      for (const auto& collider : contacts.all())
        depth = std::max(depth, -collider->query(view.t, place).gap);
      now.deepest = std::max(now.deepest, depth);
      const double excess = depth / (kDeep * position_scale(place));
      if (!(excess > excess_) || !view.free(i)) continue;
      excess_ = excess;
      sunk_ = i;
      sunk_by_ = depth;
    }
    return now;
  }

  std::string colliders() {
    const Contacts& contacts = particles_of(*system_)->contacts();
    const auto [touched, deepest] = measure();
    if (touched == 0) return {};
    std::string words = "contact: " + std::to_string(touched) +
                        (touched == 1 ? " particle" : " particles") + ", deepest " +
                        brief(deepest, 2) + " m";
    if (const std::int64_t uncut = contacts.work_sums().uncut(); uncut > 0)
      words += ", " + std::to_string(uncut) + " steps with too many touches to be cut at each";
    return words;
  }

  Simulation* system_;
  EnergyBalance& balance_;
  double excess_ = 0, sunk_by_ = 0;  // of the worst penetration; m
  int sunk_ = -1;                    // that particle
  bool elastic_;                     // all bodies that touch something
};

}  // namespace

std::unique_ptr<Criterion> watch_contact(const Watched& run) {
  if (!run.system.second_order()) return nullptr;
  if (particles_of(run.system)->contacts().empty() && run.system.corrections().empty())
    return nullptr;
  return std::make_unique<ContactCriterion>(run);
}

}  // namespace sim::study
