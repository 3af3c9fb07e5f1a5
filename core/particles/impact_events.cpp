#include "core/particles/impact_events.h"

#include <cmath>

namespace sim {
namespace {

constexpr double kEdge = 1e-2;    // of the velocity: a rate of the gap beyond what drift leaves
constexpr double kStill = 1e-10;  // m/s, velocities in which nothing shows

// The rate of the gap as a share of the velocity.
double rate_share(const Collider& collider, double t, const Vec3& place, const Vec3& velocity,
                  double gained) {
  const SurfaceSample sample = collider.query(t, place);
  const Vec3 relative = velocity - sample.velocity;
  return std::fabs(relative.dot(sample.normal)) / (relative.norm() + gained + kStill);
}

}  // namespace

// Drift off a smooth surface grows steadily, beyond an edge the rate is another one at once.
double ImpactEvents::edge_on(const Collider& collider, double h, const StepPath& path,
                             double gained) const {
  constexpr int kHalvings = 40;
  const auto share = [&](double s) {
    return rate_share(collider, t_ + s * h, path.at(s), path.rate(s) / h, gained);
  };
  if (!(share(1) > kEdge)) return 1;
  double before = 0, after = 1;
  for (int n = 0; n < kHalvings; ++n) {
    const double middle = 0.5 * (before + after);
    (share(middle) > kEdge ? after : before) = middle;
  }
  return share(after) > 2 * kEdge ? before : 1;
}

bool ImpactEvents::is_at_edge(const Collider& collider, double t, const Vec3& place,
                              const Vec3& velocity, const SurfaceSample& sample) {
  const Vec3 slip = tangential(velocity - sample.velocity, sample.normal);
  const double speed = slip.norm();
  if (!(speed > kStill)) return false;
  const Vec3 ahead = place + kGapTolerance * position_scale(place) / speed * slip;
  return rate_share(collider, t, ahead, velocity, 0) > 2 * kEdge;
}

}  // namespace sim
