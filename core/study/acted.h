// Contact that has changed a motion.
#pragma once

#include "core/scene/simulation.h"

namespace sim::study {

// Contact so far: of particles with colliders, and corrections at the ends of steps;
// with_order_one: one that acts there alone.
struct Acted {
  bool any = false, colliders = false, with_order_one = false;
  bool broke = false;  // ties

  // Contact began or ended at the ends of steps of a method that does not locate it.
  bool at_ends(bool adaptive) const { return !adaptive && (colliders || with_order_one); }
};
Acted contact_of(Simulation& system);

}  // namespace sim::study
