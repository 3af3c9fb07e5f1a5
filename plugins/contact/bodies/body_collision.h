// Collision detection between the bodies of a scene, its colliders and its single particles.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "collide.h"
#include "collider_shape.h"
#include "core/particles/body_geometry.h"
#include "core/particles/contact_task.h"
#include "core/particles/particles.h"

namespace sim {

// Bodies have the lowest numbers; a higher number is a point: a single particle.
class BodyCollision final : public BodyGeometry {
 public:
  // Throws Error{kScene} for pairs of shapes without a collision algorithm, and for initial
  // overlap.
  BodyCollision(BodyCollisionSpec spec, const Particles& particles, const double* initial);

  int bodies() const override { return static_cast<int>(spec_.bodies.size()); }
  int singles() const { return spec_.singles; }
  const RigidBody& body(int i) const override { return spec_.bodies[static_cast<std::size_t>(i)]; }
  bool touches(int i) const override { return spec_.touches[static_cast<std::size_t>(i)]; }
  const ContactMaterial& surface(int i) const override {
    return spec_.surfaces[static_cast<std::size_t>(i)];
  }
  double radius(int i) const { return radii_[static_cast<std::size_t>(i)]; }
  // The least half thickness, m: smaller motions cannot tunnel.
  double thinness(int i) const { return thinnesses_[static_cast<std::size_t>(i)]; }
  bool are_tied(int body, int particle) const override;
  bool leaves_some_out() const { return !spec_.left_out.empty(); }
  bool leaves_out(int particle) const {
    return leaves_some_out() && spec_.left_out[static_cast<std::size_t>(particle)];
  }
  bool are_joined(int i, int j) const;  // two bodies

  // Appends the contact points with a gap of at most `margin` of two bodies, or of a body and a
  // point, in these states; and of a body and a collider.
  void find_contacts(int first, const RigidState& a, int second, const RigidState& b, double margin,
                     std::vector<ManifoldPoint>& out) const;
  void find_contacts(int first, const RigidState& a, std::size_t collider, double t, double margin,
                     std::vector<ManifoldPoint>& out) const;

 private:
  // A body has one part, or those of a compound.
  struct Part {
    const RigidShape* shape;
    std::shared_ptr<const Hull> hull;  // of all parts of this shape; null where it has none
    Vec3 at;                           // of its frame in that of the body, m
    Mat3 axes;
    Vec3 middle;  // m, of the same frame, and the radius of a ball about it that holds the part
    double radius = 0;
  };

  std::span<const Part> parts(int i) const { return parts_[static_cast<std::size_t>(i)]; }
  Placed placed(int i, const Part& part, const RigidState& state) const;
  // Calls take(part, number) of those that may touch a ball.
  template <class Take>
  void each_near(int i, const RigidState& state, const Vec3& center, double radius,
                 const Take& take) const;
  const ColliderShape* shape_of(const Collider& collider) const;  // null where it has none
  bool is_convex(int i, const RigidState& state) const;
  void touch_point(int body, const RigidState& state, const Vec3& point, double margin,
                   std::vector<ManifoldPoint>& out) const;
  std::string name_of(int i) const;  // a body, or behind those a single particle
  void check_start(const double* initial) const;
  void check_convex(int i, const RigidState& state) const;
  void check_pair(int i, int j, const RigidState& a, const RigidState& b) const;
  void check_collider(int i, const RigidState& a, std::size_t collider) const;

  BodyCollisionSpec spec_;
  const Particles* particles_;
  std::vector<double> radii_, thinnesses_;
  std::vector<std::vector<Part>> parts_;
  std::vector<std::pair<const Collider*, ColliderShape>> shapes_;  // as bodies with faces see them
};

}  // namespace sim
