// Contact of surfaces whose particles are constrained.
#include <algorithm>

#include "surface_contact.h"

namespace sim {
namespace {

constexpr int kHeldRounds = 12;  // of impulses and constraints, with new normals in each
constexpr int kHeldTurns = 4;    // of the two with the same normals
constexpr int kHeldSweeps = 12;  // of rows in a turn

}  // namespace

// Adds rows for particles that would end inside a body, along its normal; the body yields by its
// mass. True if there are any.
bool SurfaceContact::meet_bodies() {
  if (!bodies_) return false;
  const ParticleView end = islands_->end(from_, displacement_);
  bool any = false;
  for (int b = 0; b < bodies_->bodies(); ++b) {
    if (!bodies_->touches(b)) continue;
    const RigidBody& body = bodies_->body(b);
    const RigidState state = body.state(end);
    const double reach = bodies_->radius(b);
    for (const int i : pairs_.parts().vertices()) {
      const Vec3 point = end.position(i);
      if ((point - state.center).squaredNorm() > reach * reach) continue;
      if (bodies_->are_tied(b, i)) continue;
      points_.clear();
      bodies_->touch_point(b, state, point, -kContactInside * spec_.thickness, points_);
      for (const ManifoldPoint& at : points_) {
        const Vec3 surface = point + at.gap * at.normal;
        const auto weights =
            body.weights(body.center() + transposed(state.axes) * (surface - state.center));
        ContactRow row{.normal = -at.normal};
        row.ids[0] = i, row.weights[0] = 1;
        row.bound = row.normal.dot(displacement_[slot(i)]) - at.gap;
        for (int p = 0; p < RigidBody::kParticles; ++p) {
          const auto k = static_cast<std::size_t>(p);
          row.ids[k + 1] = body.first() + p, row.weights[k + 1] = -weights[k];
          row.bound -= weights[k] * row.normal.dot(displacement_[slot(body.first() + p)]);
        }
        row.slack = 0.1 * kContactInside * spec_.thickness;
        row.friction = friction_of(row, bodies_->surface(b));
        impulses_.add(row, inverse_mass_);
        any = true;
      }
    }
  }
  return any;
}

// Alternates impulses along rows and projection onto the constraints: block Gauss-Seidel on the
// multipliers of both, in the metric of the masses, in which each turn approaches the displacements
// that obey all (Dykstra (1983), J. Amer. Stat. Assoc. 78, 837-842). The last turn is a projection.
bool SurfaceContact::relax_constrained(Particles& particles, double t_end) {
  for (int turn = 0; turn < kHeldTurns; ++turn) {
    bool inside = meet_colliders(particles, t_end, turn == 0 ? dirty_ : touched_);
    inside = meet_bodies() || inside;
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
    round_displacements();
    if (pairs_.follow(from_, displacement_, particles.pool()) || round == 0)
      std::ranges::fill(dirty_, std::uint8_t{1});
    pairs_.find_hits(from_, displacement_, dirty_, particles.pool(), hits_);
    bool stays = !meet_colliders(particles, t_end, touched_);
    stays = !meet_bodies() && stays;
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
    round_displacements();
    pairs_.follow(from_, displacement_, particles.pool());
    std::ranges::fill(dirty_, std::uint8_t{1});
    pairs_.find_hits(from_, displacement_, dirty_, particles.pool(), hits_);
    if (hits_.empty()) return true;
    if (!islands_->shares()) ++counts_.shortened;
    islands_->share(displacement_);
    for (const ProximityHit& met : hits_) islands_->join(pairs_.pairs()[met.pair].ids, met.s);
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
