#include "surface_correction.h"

namespace sim {

SurfaceCorrection::SurfaceCorrection(SurfaceContactSpec spec, Particles& particles,
                                     ConstraintSystem* constraint_system,
                                     const ParticleView& initial)
    : contact_(std::move(spec), particles, constraint_system, initial), particles_(&particles) {}

StepCorrection::Outcome SurfaceCorrection::apply(const Step& step) {
  switch (contact_.resolve(*particles_, step.t, step.h, step.x, step.x_next)) {
    case SurfaceContact::Outcome::kRefused:
      return Outcome::kFailed;
    case SurfaceContact::Outcome::kChanged:
      return Outcome::kChanged;
    case SurfaceContact::Outcome::kFree:
      break;
  }
  return Outcome::kUnchanged;
}

StepCorrection::Account SurfaceCorrection::account() const {
  const SurfaceContact::Counts& counts = contact_.counts();
  Account account{.words = "contact kept none apart",
                  .acted = counts.steps > 0,
                  .figures = {{"steps", static_cast<double>(counts.steps)},
                              {"pairs", static_cast<double>(counts.pairs)},
                              {"zones", static_cast<double>(counts.zones)},
                              {"shortened", static_cast<double>(counts.shortened)},
                              {"deepest", counts.deepest}}};
  if (!account.acted) return account;
  account.words = "contact kept up to " + std::to_string(counts.pairs) +
                  (counts.pairs == 1 ? " pair apart" : " pairs apart");
  if (counts.zones > 0)
    account.words += ", " + std::to_string(counts.zones) + " particles as one piece";
  if (counts.shortened > 0)
    account.words += ", in " + std::to_string(counts.shortened) +
                     (counts.shortened == 1 ? " step" : " steps") +
                     " what constraints join went a shorter way";
  return account;
}

}  // namespace sim
