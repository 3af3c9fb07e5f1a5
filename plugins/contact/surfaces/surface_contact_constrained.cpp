// Contact of surfaces whose particles are constrained.
#include <algorithm>

#include "surface_contact.h"

namespace sim {
namespace {

constexpr int kHeldRounds = 12;  // of impulses and constraints, with new normals in each
constexpr int kHeldTurns = 4;    // of the two with the same normals
constexpr int kHeldSweeps = 12;  // of rows in a turn

}  // namespace

// Alternates impulses along rows and projection onto the constraints: block Gauss-Seidel on the
// multipliers of both, in the metric of the masses, in which each turn approaches the displacements
// that obey all (Dykstra (1983), J. Amer. Stat. Assoc. 78, 837-842). The last turn is a projection.
bool SurfaceContact::relax_constrained(Particles& particles, double t_end) {
  for (int turn = 0; turn < kHeldTurns; ++turn) {
    const bool inside = meet_colliders(particles, t_end, turn == 0 ? dirty_ : touched_);
    const bool pushed =
        impulses_.relax(kHeldSweeps, inverse_mass_, displacement_, touched_, dirty_);
    if (!pushed && !inside && (turn > 0 || !std::ranges::count(touched_, 1))) break;
    if (!islands_->project_displacements(from_, displacement_, touched_, dirty_)) return false;
    impulses_.note_moved(touched_);
  }
  return true;
}

// False if no displacements were found that satisfy the constraints without hits.
bool SurfaceContact::advance_constrained(Particles& particles, double t_end) {
  for (int round = 0; round < kHeldRounds; ++round) {
    if (particles.pool().gives_up(0)) return false;
    if (!relax_constrained(particles, t_end)) {
      displacement_ = free_displacement_;
      return false;
    }
    find_hits(particles.pool(), round == 0);
    bool stays = !meet_colliders(particles, t_end, touched_);
    stays = !limit_strain() && stays;
    if (hits_.empty() && stays) return true;
    std::ranges::fill(dirty_, std::uint8_t{0});
    add_hits();
  }
  return hits_.empty();
}

// Islands that still collide advance a smaller share of their step, until nothing collides.
bool SurfaceContact::advance_shortened(Particles& particles) {
  std::ranges::fill(dirty_, std::uint8_t{1});
  for (;;) {
    if (particles.pool().gives_up(0)) return false;
    find_hits(particles.pool(), true);
    if (hits_.empty()) return true;
    if (!islands_->shares()) ++counts_.shortened;
    islands_->share(displacement_);
    for (const ProximityHit& met : hits_) {
      const SurfacePair& pair = pairs_.pairs()[met.pair];
      islands_->join(bodies_ ? bodies_->movers(pair, inverse_mass_) : pair.ids, met.s);
    }
    if (!islands_->apply(from_, displacement_, touched_, dirty_)) {
      refusal_ =
          "particle " + std::to_string(islands_->culprit()) +
          " is moved by constraints, or by its prescribed path, through a surface that has no room "
          "left";
      return false;
    }
  }
}

// Solves the velocities: no contact approaches further, with friction, and constraints hold.
void SurfaceContact::find_constrained_velocities() {
  islands_->share_velocities(velocity_);
  for (int turn = 0; turn < kHeldTurns; ++turn) {
    const bool pushed = impulses_.relax(kHeldSweeps, inverse_mass_, velocity_, touched_, dirty_);
    if (!pushed && (turn > 0 || !std::ranges::count(touched_, 1))) break;
    islands_->project_velocities(from_, displacement_, velocity_, touched_);
    impulses_.note_moved(touched_);
  }
}

// Slows all islands in contact, at last to rest: then false.
bool SurfaceContact::give_way(Particles& particles) {
  islands_->share(displacement_);
  return islands_->slow(touched_) && islands_->apply(from_, displacement_, touched_, dirty_) &&
         advance_shortened(particles);
}

}  // namespace sim
