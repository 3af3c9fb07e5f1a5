// Substeps of surface contact, for kinematic particles whose whole step at once has no solution.
#include "surface_contact.h"

namespace sim {
namespace {

constexpr int kLegs = 1024;  // of a step, at most

}  // namespace

// Each substep is a part of the free step from the end of the last one; a refused one is halved,
// and two that succeeded are followed by one twice as long. Kinematic particles end each on their
// paths.
bool SurfaceContact::advance_substeps(Particles& particles, double t, double h) {
  int done = 0, substep = kLegs / 2;
  for (;;) {
    if (particles.pool().gives_up(0)) return false;
    const double end = static_cast<double>(done + substep) / kLegs;
    const double part = static_cast<double>(substep) / kLegs;
    for (const int i : movable_) {
      const std::size_t k = slot(i);
      displacement_[k] = inverse_mass_[k] > 0 ? part * free_displacement_[k]
                                              : first_[k] + end * free_displacement_[k] - from_[k];
    }
    pairs_.begin(points(), particles.pool());
    if (advance(particles, t + end * h)) {
      done += substep;
      if (done == kLegs) break;
      for (const int i : movable_) from_[slot(i)] += displacement_[slot(i)];
      if (done % (2 * substep) == 0) substep *= 2;
    } else if (substep > 1) {
      substep /= 2;
    } else {
      return false;
    }
  }
  refusal_.clear();
  return true;
}

// Joins the substeps to one displacement from the start of the step.
void SurfaceContact::join_substeps() {
  for (const int i : movable_) {
    const std::size_t k = slot(i);
    if (from_[k] == first_[k]) continue;
    displacement_[k] = (from_[k] - first_[k]) + displacement_[k];
    from_[k] = first_[k];
  }
}

}  // namespace sim
