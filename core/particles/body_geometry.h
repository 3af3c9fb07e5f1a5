// The rigid bodies of a scene, as other corrections of steps see them.
#pragma once

#include "core/particles/collider.h"
#include "core/particles/rigid/rigid_body.h"

namespace sim {

class BodyGeometry {
 public:
  virtual ~BodyGeometry() = default;

  virtual int bodies() const = 0;
  virtual const RigidBody& body(int i) const = 0;
  virtual bool touches(int i) const = 0;  // whether anything may touch it
  virtual const ContactMaterial& surface(int i) const = 0;
  virtual bool are_tied(int body, int particle) const = 0;  // joined: they do not touch
};

}  // namespace sim
