#include "impact_zones.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr double kShareUsed = 0.8;  // of the share known to be free
constexpr int kHalvings = 6;        // before a zone moves rigidly

}  // namespace

void ImpactZones::begin(std::span<const Vec3> displacements) {
  joined_.separate(displacements.size());
  in_zone_.assign(displacements.size(), false);
  sums_.resize(displacements.size());
  displacements_.assign(displacements.begin(), displacements.end());
  members_.clear();
  met_.clear();
  culprit_ = -1;
}

void ImpactZones::join(const std::array<int, 4>& ids, double s) {
  bool known = true;
  for (const int id : ids) {
    known = known && in_zone_[slot(id)] && root(id) == root(ids[0]);
    if (in_zone_[slot(id)]) continue;
    in_zone_[slot(id)] = true;
    sums_[slot(id)] = {};
    members_.push_back(id);
  }
  if (known) {
    ++sums_[slot(root(ids[0]))].slowed;
    return;
  }
  met_.push_back({ids[0], s});
  for (const int id : ids) {
    const auto [low, high] = std::minmax({root(ids[0]), root(id)});
    joined_.join(low, high);
    sums_[slot(low)].slowed = std::max(sums_[slot(low)].slowed, sums_[slot(high)].slowed);
  }
}

void ImpactZones::add_up(std::span<const double> inverse_mass, std::span<const Vec3> places,
                         std::span<const Vec3> of) {
  motions_.clear();
  for (const int i : members_) {
    Sum& sum = sums_[slot(i)];
    sum = {.slowed = sum.slowed};
  }
  for (const Met& met : met_) {
    double& share = sums_[slot(root(met.id))].share;
    share = std::min(share, kShareUsed * met.s);
  }
  for (const int i : members_) {
    Sum& sum = sums_[slot(root(i))];
    if (inverse_mass[slot(i)] > 0) {
      sum.mass += 1 / inverse_mass[slot(i)];
      sum.moment += of[slot(i)] / inverse_mass[slot(i)];
    } else if (sum.leader < 0) {
      sum.leader = i;
      sum.kinematic_motion = of[slot(i)];
    } else if (sum.motion < 0 && of[slot(i)] != sum.kinematic_motion) {
      sum.motion = static_cast<int>(motions_.size());
      motions_.emplace_back();
    }
  }
  for (const int i : members_) {
    const Sum& of_root = sums_[slot(root(i))];
    if (of_root.motion >= 0 && inverse_mass[slot(i)] == 0)
      motions_[slot(of_root.motion)].add(places[slot(i)], of[slot(i)]);
    Sum& sum = sums_[slot(i)];
    if (root(i) != i) continue;
    if (sum.leader < 0) sum.kinematic_motion = sum.moment / sum.mass;
    sum.share = sum.slowed > kHalvings ? 0 : std::ldexp(sum.share, -sum.slowed);
  }
}

bool ImpactZones::apply(std::span<const double> inverse_mass, std::span<const Vec3> places,
                        std::span<Vec3> displacement) {
  add_up(inverse_mass, places, displacements_);
  for (const int i : members_) {
    const Sum& sum = sums_[slot(root(i))];
    const bool still = sum.slowed > kHalvings + 1;
    if (inverse_mass[slot(i)] > 0) {
      const Vec3 with = still ? Vec3::Zero() : kinematic_motion(sum, places[slot(i)]);
      displacement[slot(i)] = with + sum.share * (displacements_[slot(i)] - with);
    } else if (still && displacements_[slot(i)] != Vec3::Zero()) {
      culprit_ = i;
      return false;
    }
  }
  return true;
}

void ImpactZones::slow(std::span<const double> inverse_mass, std::span<const Vec3> places,
                       std::span<Vec3> velocity) {
  add_up(inverse_mass, places, velocity);
  for (const int i : members_) {
    const Sum& sum = sums_[slot(root(i))];
    if (inverse_mass[slot(i)] == 0) continue;
    const Vec3 with = kinematic_motion(sum, places[slot(i)]);
    velocity[slot(i)] = with + sum.share * (velocity[slot(i)] - with);
  }
}

}  // namespace sim
