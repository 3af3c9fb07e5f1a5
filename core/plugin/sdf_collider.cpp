#include "core/plugin/sdf_collider.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/plugin/surface_params.h"

namespace sim {

SdfCollider::SdfCollider(const Params& params, const Vec3& center)
    : center_(center),
      surface_(surface_from(params)),
      thickness_(params.number("thickness")),
      inside_(params.has("inside") && params.flag("inside")) {
  if (params.has("motion")) motion_ = params.motion("motion");
}

void SdfCollider::prepare_interval(double t0, double t1) {
  t0_ = t0;
  t1_ = t1;
  first_ = motion_->at(t0, center_);
  last_ = t1 > t0 ? motion_->at(t1, center_) : first_;
}

// Between two samples the motion is the cubic through both ends (Hermite).
Pose SdfCollider::pose(double t) const {
  if (!motion_) return {.center = center_};
  if (!motion_->sampled()) return motion_->at(t, center_);
  if (t <= t0_) return first_;
  if (t >= t1_) return last_;
  const double h = t1_ - t0_, s = (t - t0_) / h;
  const Vec3 way = last_.center - first_.center;
  const Vec3 second = 3 * way - h * (2 * first_.velocity + last_.velocity);
  const Vec3 third = h * (first_.velocity + last_.velocity) - 2 * way;
  Pose pose;
  pose.center = first_.center + s * (h * first_.velocity + s * (second + s * third));
  pose.velocity = first_.velocity + (s / h) * (2 * second + 3 * s * third);
  return pose;
}

SurfaceSample SdfCollider::query(double t, const Vec3& x) const {
  if (!motion_) {
    const Distance seen = distance(x - center_);
    if (inside_) return {-seen.gap - thickness_, -seen.normal};
    return {seen.gap - thickness_, seen.normal};
  }
  const Pose pose = this->pose(t);
  const Distance seen = distance(pose.turned_back(x - pose.center));
  const Vec3 normal = pose.turned(seen.normal), velocity = pose.velocity_at(x);
  if (inside_) return {-seen.gap - thickness_, -normal, velocity};
  return {seen.gap - thickness_, normal, velocity};
}

RenderShape SdfCollider::shape(double t) const {
  RenderShape shape = form();
  const Pose pose = this->pose(t);
  shape.center = pose.center + pose.turned(shape.center);
  for (Vec3& axis : shape.axes) axis = pose.turned(axis);
  shape.inside = inside_;
  return shape;
}

PrimitiveSurface SdfCollider::as_primitive(double t) const {
  PrimitiveSurface surface = plain_form();
  const Pose pose = this->pose(t);
  if (pose.sine != 0 || pose.cosine != 1 || pose.rate != 0) return {};
  surface.center = pose.center;
  surface.velocity = pose.velocity;
  surface.thickness = thickness_;
  surface.inside = inside_;
  return surface;
}

double SdfCollider::clearance(double t, const Vec3& middle, const Vec3& half) const {
  const Pose pose = this->pose(t);
  const Vec3 x = motion_ ? pose.turned_back(middle - pose.center) : Vec3(middle - center_);
  if (inside_) return -distance(x).gap - thickness_ - half.norm();
  // A rotated box is inside the cube of its half diagonal.
  const bool turned = pose.sine != 0 || pose.cosine != 1;
  return (turned ? distance(x).gap - half.norm() : least(x, half)) - thickness_;
}

double SdfCollider::max_speed(double t0, double /*t1*/) const {
  if (!motion_) return 0;
  if (!motion_->sampled())
    return motion_->max_speed() + motion_->max_angular_speed() * turning_radius(pose(t0).axis);
  // The derivative of the cubic is inside the convex hull of its Bezier points.
  const double a = first_.velocity.norm(), b = last_.velocity.norm();
  if (!(t1_ > t0_)) return std::max(a, b);
  const Vec3 way = 3 / (t1_ - t0_) * (last_.center - first_.center);
  return std::max({a, b, Vec3(way - first_.velocity - last_.velocity).norm()});
}

Vec3 SdfCollider::advect(double t0, double t1, const Vec3& x) const {
  if (!motion_) return x;
  const Pose before = pose(t0), after = pose(t1);
  if (before.rate == 0 && after.rate == 0) return x + (after.center - before.center);
  return after.center + after.turned(before.turned_back(x - before.center));
}

ContactMaterial surface_from(const Params& params) {
  const double restitution = params.number("restitution"), friction = params.number("friction");
  if (!params.has("law")) return {restitution, friction};
  if (restitution != 0 || friction != 0)
    throw Error(ErrorKind::kScene,
                {"bad law of contact", "",
                 "restitution and friction are given beside it, and it has its own",
                 "give either the law or these numbers, which are sim.law.coulomb"});
  return surface_of(params.law("law"));
}

ParamList surface_params() {
  return {friction_param(),
          restitution_param(),
          {.name = "law",
           .type = ParamType::kLaw,
           .doc = "how it bounces and rubs, in place of friction and restitution"}};
}

ParamList solid_params(ParamList own, bool room) {
  for (Param& param : surface_params()) own.push_back(std::move(param));
  own.push_back({.name = "thickness",
                 .default_value = 0.0,
                 .unit = "m",
                 .doc = "how far from the surface particles are held",
                 .min = 0});
  if (room)
    own.push_back({.name = "inside",
                   .type = ParamType::kFlag,
                   .default_value = false,
                   .doc = "a room: all around it is solid"});
  own.push_back({.name = "motion",
                 .type = ParamType::kMotion,
                 .doc =
                     "how it moves; a function(t) returns where its center is, {x, y, z}, and as "
                     "a second value, if it likes, with which velocity"});
  return own;
}

}  // namespace sim
