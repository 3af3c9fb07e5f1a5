// Impact zones: particles that cannot be kept apart otherwise move as one rigid set (Provot 1997).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/disjoint_sets.h"
#include "core/base/slot.h"
#include "core/math/vec3.h"
#include "kinematic_fit.h"

namespace sim {

// Sets of particles that share a motion. In a zone every displacement is w + a (d - w): w their
// mean by mass, or that of its kinematic particles; d the free one. All distances inside then are
// those of the displacements d at the time a s; so a pair that hits at s does not if a < s. With a
// = 0 the zone moves rigidly, and in the end not at all. Zones only grow, so this terminates. If
// kinematic particles have several motions, w is their KinematicFit.
class ImpactZones {
 public:
  void begin(std::span<const Vec3> displacements);
  bool empty() const { return members_.empty(); }
  std::span<const int> members() const { return members_; }

  // Joins the particles of a hit at the share s of their displacements; a hit within a zone slows
  // it.
  void join(const std::array<int, 4>& ids, double s);
  // displacement := the one under the zones, from those given to begin(). False if
  // kinematic particles move a zone that has to stop: culprit().
  bool apply(std::span<const double> inverse_mass, std::span<const Vec3> places,
             std::span<Vec3> displacement);
  int culprit() const { return culprit_; }
  // Velocities relative to the mean of the zone, likewise: kinetic energy falls, momentum is
  // conserved.
  void slow(std::span<const double> inverse_mass, std::span<const Vec3> places,
            std::span<Vec3> velocity);

 private:
  struct Sum {
    Vec3 moment{}, kinematic_motion{};
    double mass = 0, share = 1;
    int leader = -1, slowed = 0;
    int motion = -1;  // in motions_, if kinematic particles have several
  };

  int root(int i) { return joined_.root(i); }
  void add_up(std::span<const double> inverse_mass, std::span<const Vec3> places,
              std::span<const Vec3> of);
  Vec3 kinematic_motion(const Sum& sum, const Vec3& place) const {
    return sum.motion < 0 ? sum.kinematic_motion : motions_[slot(sum.motion)].at(place);
  }

  DisjointSets joined_;
  std::vector<bool> in_zone_;
  std::vector<int> members_;
  std::vector<Sum> sums_;  // of roots
  std::vector<KinematicFit> motions_;
  std::vector<Vec3> displacements_;
  struct Met {
    int id;
    double s;
  };
  std::vector<Met> met_;
  int culprit_ = -1;
};

}  // namespace sim
