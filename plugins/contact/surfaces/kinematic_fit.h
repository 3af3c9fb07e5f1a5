// A motion of space that fits the prescribed points.
#pragma once

#include <vector>

#include "core/math/vec3.h"

namespace sim {

// Interpolates the displacements of kinematic particles. If these move by a similarity
// (translation, rotation, scaling), all space does, so that separate points stay separate;
// otherwise it is smooth between them.
class KinematicFit {
 public:
  void add(const Vec3& place, const Vec3& displacement) {
    kinematic_.push_back({place, displacement});
  }
  Vec3 at(const Vec3& place) const;  // displacement of the space there; zero if nothing was added

 private:
  struct KinematicPoint {
    Vec3 place, displacement;
  };
  std::vector<KinematicPoint> kinematic_;
};

}  // namespace sim
