// The geometry of rigid bodies for other corrections of steps: contact points on their surfaces.
#pragma once

#include <vector>

#include "core/particles/collider.h"
#include "core/particles/rigid/rigid_body.h"

namespace sim {

struct ManifoldPoint {
  Vec3 x;           // m, in the middle of the gap
  Vec3 normal;      // of length 1, from the second to the first
  double gap = 0;   // m, < 0 where they overlap
  int feature = 0;  // the same from step to step, as long as the same parts touch
};

class BodyGeometry {
 public:
  virtual ~BodyGeometry() = default;

  virtual int bodies() const = 0;
  virtual const RigidBody& body(int i) const = 0;
  virtual bool touches(int i) const = 0;  // whether anything may touch it
  virtual const ContactMaterial& surface(int i) const = 0;
  virtual double radius(int i) const = 0;                   // m, of a ball around its center
  virtual bool are_tied(int body, int particle) const = 0;  // joined: they do not touch

  // Appends the contact points of a body in this state, the first of the two, and a point with a
  // gap of at most `margin`, m.
  virtual void touch_point(int body, const RigidState& state, const Vec3& point, double margin,
                           std::vector<ManifoldPoint>& out) const = 0;
};

}  // namespace sim
