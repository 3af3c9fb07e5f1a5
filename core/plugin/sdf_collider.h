// The common part of colliders with a signed distance: their material, their thickness, and their
// motion.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/geometry/rigid_motion.h"
#include "core/particles/collider.h"
#include "core/plugin/params.h"

namespace sim {

// A shape about the origin that moves as a rigid body. A derived class gives the shape; with
// `inside` everything around it is solid.
class SdfCollider : public Collider {
 public:
  ContactMaterial material() const final { return surface_; }
  SurfaceSample query(double t, const Vec3& x) const final;
  double clearance(double t, const Vec3& middle, const Vec3& half) const final;
  double max_speed(double t0, double t1) const final;
  Vec3 advect(double t0, double t1, const Vec3& x) const final;
  bool moves() const final { return motion_ != nullptr; }
  bool sampled() const final { return motion_ && motion_->sampled(); }
  void prepare_interval(double t0, double t1) final;
  RenderShape shape(double t) const final;
  PrimitiveSurface as_primitive(double t) const final;
  std::string note() const final { return motion_ ? motion_->note() : ""; }

 protected:
  // Reads solid_params(); center: of the body at rest, and of its rotations.
  SdfCollider(const Params& params, const Vec3& center);

  struct Distance {
    double gap;   // m, < 0 inside of the shape
    Vec3 normal;  // its gradient
  };
  virtual Distance distance(const Vec3& x) const = 0;

  // The drawn shape about the origin, without rotation.
  virtual RenderShape form() const = 0;

  // See Collider::as_primitive, for the shape about the origin.
  virtual PrimitiveSurface plain_form() const { return {}; }

  // See Collider::clearance, for the shape without rotation; `half` bounds the box.
  virtual double least(const Vec3& middle, const Vec3& half) const {
    return distance(middle).gap - half.norm();
  }

  // The distance, m, from the origin to the farthest point of the shape that a rotation about an
  // axis moves in directions other than along the surface.
  virtual double turning_radius(const Vec3& /*axis*/) const { return 0; }

  bool inside() const { return inside_; }
  void fill_outside() { inside_ = false; }  // the shape itself is solid

 private:
  Pose pose(double t) const;

  Vec3 center_;
  std::shared_ptr<const RigidMotion> motion_;  // null: at rest
  ContactMaterial surface_;
  double thickness_;
  bool inside_;
  double t0_ = 0, t1_ = 0;  // the samples of a sampled motion
  Pose first_, last_;
};

// The material from the parameters `restitution`, `friction` and `law`; a law replaces the numbers.
// Throws Error{kScene} if both are given.
ContactMaterial surface_from(const Params& params);

// The declarations of these three parameters.
ParamList surface_params();

// The own parameters of a solid, followed by the common ones; `inside` only if `room`.
ParamList solid_params(ParamList own, bool room = true);

}  // namespace sim
