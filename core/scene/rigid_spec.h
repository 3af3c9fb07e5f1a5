// The rigid bodies of a scene as plain data.
#pragma once

#include <memory>
#include <vector>

#include "core/particles/collider.h"
#include "core/particles/rigid/rigid_body.h"
#include "core/plugin/params.h"

namespace sim {

// One sim.rigid{...}; it is four particles of the scene.
struct RigidSpec {
  std::shared_ptr<const RigidShape> shape;
  double mass = 0;                                    // kg, > 0
  Vec3 position{0, 0, 0};                             // m, of the origin of the shape
  Vec3 rotation{0, 0, 0};                             // rad, about this axis
  Vec3 velocity{0, 0, 0}, angular_velocity{0, 0, 0};  // of the center of mass, m/s; rad/s, in space
  ContactMaterial surface = {};
  bool touches = true;  // whether it collides
  int first = 0;        // id of its first particle
  SourceLocation place = {};
};

// A point of a body, in the frame of its shape, m. Forces and constraints may name point k of a
// scene of n particles as n + k.
struct BodyPoint {
  int body = 0;
  Vec3 at{0, 0, 0};
};

struct SystemSpec;

// Appends the particles of the bodies to those of the scene. Throws Error{kScene}.
void place_bodies(SystemSpec& spec);

}  // namespace sim
