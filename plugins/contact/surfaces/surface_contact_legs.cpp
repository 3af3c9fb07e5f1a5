// Steps in which particles are led where there is no room at once: leg after leg.
#include "surface_contact.h"

namespace sim {
namespace {

constexpr int kLegs = 1024;  // of a step, at most

}  // namespace

// Each leg is a part of the free step from where the last one ended; one that is refused is halved,
// and two that were not are followed by one twice as long. What is led ends each on its way.
bool SurfaceContact::advance_legs(Particles& particles, double t, double h) {
  int done = 0, leg = kLegs / 2;
  for (;;) {
    const double end = static_cast<double>(done + leg) / kLegs;
    const double part = static_cast<double>(leg) / kLegs;
    for (const int i : movers_) {
      const std::size_t k = slot(i);
      way_[k] =
          inverse_mass_[k] > 0 ? part * free_way_[k] : first_[k] + end * free_way_[k] - from_[k];
    }
    pairs_.begin(from_, way_, particles.team());
    if (advance(particles, t + end * h)) {
      done += leg;
      if (done == kLegs) break;
      for (const int i : movers_) from_[slot(i)] += way_[slot(i)];
      if (done % (2 * leg) == 0) leg *= 2;
    } else if (leg > 1) {
      leg /= 2;
    } else {
      return false;
    }
  }
  refusal_.clear();
  return true;
}

// One way again, from the start of the step.
void SurfaceContact::join_legs() {
  for (const int i : movers_) {
    const std::size_t k = slot(i);
    if (from_[k] == first_[k]) continue;
    way_[k] = (from_[k] - first_[k]) + way_[k];
    from_[k] = first_[k];
  }
}

}  // namespace sim
