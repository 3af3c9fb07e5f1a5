// The shape of a collider as data, for pages, pictures and files.
#pragma once

#include <array>
#include <cmath>
#include <memory>

#include "core/math/vec3.h"

namespace sim {

struct RigidShape;

struct RenderShape {
  enum class Form { kNone, kPlane, kSphere, kBox, kCapsule, kMesh };

  Form form = Form::kNone;
  Vec3 center{0, 0, 0};  // m; a point of a plane, the middle of a capsule's axis
  // Three right angles, right-handed: the half edges of a box in m; of a plane directions of length
  // 1, the second its normal; of a capsule the first is half of its axis, in m.
  std::array<Vec3, 3> axes{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
  double radius = 0;    // m, of a sphere and a capsule; around the center of a mesh
  bool inside = false;  // it is hollow: particles are kept in
  bool body = false;    // it is a rigid body of the scene, no collider
  std::shared_ptr<const RigidShape> mesh = {};  // of a mesh, whose axes have length 1
};

// A plane, with its two tangent directions chosen.
inline RenderShape plane_shape(const Vec3& point, const Vec3& normal) {
  const Vec3 u = normal.cross(std::abs(normal.x()) < 0.9 ? Vec3(1, 0, 0) : Vec3(0, 0, 1));
  const Vec3 first = u / u.norm();
  return {RenderShape::Form::kPlane, point, {first, normal, first.cross(normal)}};
}

}  // namespace sim
