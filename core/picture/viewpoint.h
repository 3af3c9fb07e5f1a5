// The layout of a picture: the placement of the systems, the ground, the light and the eye, found
// once from all motion, so that nothing of it moves during a film.
#pragma once

#include <span>
#include <vector>

#include "core/picture/look.h"
#include "core/picture/model.h"
#include "core/picture/moments.h"
#include "core/picture/picture.h"

namespace sim {

// The part of a system that stays in view; particles that fly off further are not followed.
struct Reach {
  Vec3 middle{0, 0, 0};                                                      // m
  double radius = 0;                                                         // m
  bool holds(const Vec3& x) const { return (x - middle).norm() <= radius; }  // a number, too
};

struct Viewpoint {
  std::vector<Vec3> offsets;   // m, of each system: several stand side by side
  std::vector<Reach> reaches;  // of each system, without its offset
  Vec3 origin{0, 0, 0};        // m, the origin of the picture
  double scale = 1;            // units of the picture in one metre
  Vec3 up{0, 1, 0};
  double grid = 0;  // m, the spacing of the ground's grid
  Eye eye;
  V3 light;
  std::optional<Ground> ground;

  V3 point(const Vec3& x) const {
    const Vec3 p = scale * (x - origin);
    return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
  }
};

Viewpoint make_viewpoint(std::span<const Model> models, const Moments& moments, const Look& look);

}  // namespace sim
