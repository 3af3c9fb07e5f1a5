// What is led, as a motion of the space around it.
#pragma once

#include <vector>

#include "core/math/vec3.h"

namespace sim {

// Through the ways of particles that no force moves. Where these move alike, turn together or come
// nearer to each other alike, all space does: what is apart then stays so. Else smooth between
// them.
class LedMotion {
 public:
  void add(const Vec3& place, const Vec3& way) { led_.push_back({place, way}); }
  Vec3 at(const Vec3& place) const;  // way of the space there; zero where nothing was added

 private:
  struct Led {
    Vec3 place, way;
  };
  std::vector<Led> led_;
};

}  // namespace sim
