// Contact of surfaces whose particles constraints join.
#include <algorithm>

#include "surface_contact.h"

namespace sim {
namespace {

constexpr int kHeldRounds = 12;  // of impulses and constraints, with new normals in each
constexpr int kHeldTurns = 4;    // of the two with the same normals
constexpr int kHeldSweeps = 12;  // of rows in a turn

}  // namespace

// Particles that would end inside a body: along its normal there they do not, and the body gives
// way as its mass says. Returns whether there are any.
bool SurfaceContact::meet_bodies() {
  if (!bodies_) return false;
  const ParticleView end = held_->end(from_, way_);
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
      for (const TouchPoint& at : points_) {
        const Vec3 surface = point + at.gap * at.normal;
        const auto weights =
            body.weights(body.center() + transposed(state.axes) * (surface - state.center));
        ContactRow row{.normal = -at.normal};
        row.ids[0] = i, row.weights[0] = 1;
        row.bound = row.normal.dot(way_[slot(i)]) - at.gap;
        for (int p = 0; p < RigidBody::kParticles; ++p) {
          const auto k = static_cast<std::size_t>(p);
          row.ids[k + 1] = body.first() + p, row.weights[k + 1] = -weights[k];
          row.bound -= weights[k] * row.normal.dot(way_[slot(body.first() + p)]);
        }
        row.slack = 0.1 * kContactInside * spec_.thickness;
        row.friction = friction_of(row, bodies_->surface(b));
        rows_.add(row, inverse_mass_);
        any = true;
      }
    }
  }
  return any;
}

// Impulses along rows and the move back to the constraints, in turns: block Gauss-Seidel on the
// multipliers of both, in the metric of the masses, in which each turn comes nearer to the ways
// that obey all (Dykstra (1983), J. Amer. Stat. Assoc. 78, 837-842). The last is a move back.
bool SurfaceContact::relax_held(Particles& particles, double t_end) {
  for (int turn = 0; turn < kHeldTurns; ++turn) {
    bool inside = meet_colliders(particles, t_end, turn == 0 ? dirty_ : touched_);
    inside = meet_bodies() || inside;
    const bool pushed = rows_.relax(kHeldSweeps, inverse_mass_, way_, touched_, dirty_);
    if (!pushed && !inside && (turn > 0 || !std::ranges::count(touched_, 1))) break;
    if (!held_->hold_ways(from_, way_, touched_, dirty_)) return false;
    rows_.note_moved(touched_);
  }
  return true;
}

// False where ways that obey and do not meet were not found.
bool SurfaceContact::advance_held(Particles& particles, double t_end) {
  for (int round = 0; round < kHeldRounds; ++round) {
    if (!relax_held(particles, t_end)) {
      way_ = free_way_;
      return false;
    }
    round_ways();
    if (pairs_.follow(from_, way_, particles.team()) || round == 0)
      std::ranges::fill(dirty_, std::uint8_t{1});
    pairs_.find_meetings(from_, way_, dirty_, particles.team(), meetings_);
    bool stays = !meet_colliders(particles, t_end, touched_);
    stays = !meet_bodies() && stays;
    stays = !limit_strain() && stays;
    if (meetings_.empty() && stays) return true;
    std::ranges::fill(dirty_, std::uint8_t{0});
    add_meetings();
  }
  return meetings_.empty();
}

// What meets all the same goes a shorter way, and more so until nothing meets.
bool SurfaceContact::advance_shorter(Particles& particles) {
  std::ranges::fill(dirty_, std::uint8_t{1});
  for (;;) {
    round_ways();
    pairs_.follow(from_, way_, particles.team());
    std::ranges::fill(dirty_, std::uint8_t{1});
    pairs_.find_meetings(from_, way_, dirty_, particles.team(), meetings_);
    if (meetings_.empty()) return true;
    if (!held_->shares()) ++counts_.shortened;
    held_->share(way_);
    for (const Meeting& met : meetings_) held_->join(pairs_.pairs()[met.pair].ids, met.s);
    if (!held_->apply(from_, way_, touched_, dirty_)) {
      refusal_ = "particle " + std::to_string(held_->blamed()) +
                 " is led by constraints, or by its path, through a surface that has no room left";
      return false;
    }
  }
}

// Nothing approaches further, with friction, and all velocities obey.
void SurfaceContact::find_held_velocities() {
  held_->share_velocities(velocity_);
  for (int turn = 0; turn < kHeldTurns; ++turn) {
    const bool pushed = rows_.relax(kHeldSweeps, inverse_mass_, velocity_, touched_, dirty_);
    if (!pushed && (turn > 0 || !std::ranges::count(touched_, 1))) break;
    held_->hold_velocities(from_, way_, velocity_, touched_);
    rows_.note_moved(touched_);
  }
}

// All that contact touched goes a shorter way, at last none: then false.
bool SurfaceContact::give_way(Particles& particles) {
  held_->share(way_);
  return held_->slow(touched_) && held_->apply(from_, way_, touched_, dirty_) &&
         advance_shorter(particles);
}

}  // namespace sim
