#include "core/study/acted.h"

#include <algorithm>

#include "core/particles/particle_system.h"
#include "core/particles/step_correction.h"

namespace sim::study {

Acted contact_of(Simulation& system) {
  const auto acts = [](const auto& correction) { return correction->account().acted; };
  Acted acted;
  acted.with_order_one = std::ranges::any_of(system.corrections(), acts);
  if (const ParticleSystem* particles = particles_of(system)) {
    const Contacts& contacts = particles->contacts();
    for (int i = 0; !contacts.empty() && !acted.colliders && i < system.particles(); ++i)
      acted.colliders = contacts.work_sums().touched(i);
    acted.with_order_one |= acted.colliders && contacts.accuracy() == Accuracy::kProject;
  }
  acted.broke = !system.settings().broken.empty();
  acted.any = acted.colliders || acted.with_order_one || acted.broke;
  return acted;
}

}  // namespace sim::study
