// A plane or a sphere as numbers, for queries of many points at a time.
#pragma once

#include "core/math/vec3.h"

namespace sim {

// The surface of a shape that does not rotate, at one time:
//   plane   distance = normal.(x - center) - radius
//   sphere  distance = |x - center| - radius
//   gap = distance - thickness, or inside -distance - thickness
struct PrimitiveSurface {
  enum class Form { kNone, kPlane, kSphere };

  Form form = Form::kNone;  // kNone: it is no such surface
  Vec3 center{0, 0, 0};     // m
  Vec3 velocity{0, 0, 0};   // m/s
  Vec3 normal{0, 1, 0};     // of a plane, of length 1
  double radius = 0;        // m; of a plane: how far in front of `center` it is
  double thickness = 0;     // m
  bool inside = false;

  double gap(const Vec3& x) const {
    const Vec3 d = x - center;
    const double distance = (form == Form::kPlane ? normal.dot(d) : d.norm()) - radius;
    return (inside ? -distance : distance) - thickness;
  }
};

}  // namespace sim
