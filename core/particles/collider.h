// A collider: an obstacle with a signed distance, whose surface may move as a function of time.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/geometry/primitive_surface.h"
#include "core/geometry/render_shape.h"
#include "core/particles/contact_law.h"
#include "core/particles/view.h"

namespace sim {

// A sample of the signed distance field at one point.
struct SurfaceSample {
  double gap = 0;          // m, signed distance: < 0 inside
  Vec3 normal{0, 1, 0};    // outward, of length 1, defined everywhere
  Vec3 velocity{0, 0, 0};  // of the surface there, m/s
};

// The component of v tangential to a surface.
inline Vec3 tangential(const Vec3& v, const Vec3& normal) { return v - v.dot(normal) * normal; }

// A collider is a pure function of (t, x), as forces are.
class Collider {
 public:
  virtual ~Collider() = default;

  // Called once with the initial state; may allocate and may throw Error.
  virtual void bind(const ParticleView& /*initial*/) {}

  virtual ContactMaterial material() const = 0;

  // The shape drawn at time t; an empty shape is not drawn.
  virtual RenderShape shape(double /*t*/) const { return {}; }

  // Samples the surface from the point x at time t. The gap is 1-Lipschitz in x, so it bounds the
  // free distance.
  virtual SurfaceSample query(double t, const Vec3& x) const = 0;

  // A lower bound, m, of the gaps of all points in the box middle -+ half. Evaluated for all
  // particles, many at a time, in every step.
  virtual double clearance(double t, const Vec3& middle, const Vec3& half) const {
    return query(t, middle).gap - half.norm();
  }

  // The same surface at time t as a primitive, if it is one, for queries of many points at a time.
  virtual PrimitiveSurface as_primitive(double /*t*/) const { return {}; }

  // False if nothing depends on t.
  virtual bool moves() const { return true; }

  // A bound, m/s, on the rate of the gap of a point at rest between two times.
  virtual double max_speed(double /*t0*/, double /*t1*/) const { return 0; }

  // The position at t1 of the point of the body that is at x at t0.
  virtual Vec3 advect(double t0, double t1, const Vec3& x) const {
    return x + (t1 - t0) * query(0.5 * (t0 + t1), x).velocity;
  }

  // True if prepare_interval() has to be called before queries between two times: for colliders
  // that can be evaluated on one thread only. It may throw Error{kScene}.
  virtual bool sampled() const { return false; }
  virtual void prepare_interval(double /*t0*/, double /*t1*/) {}

  // A shape with inner edges, at which particles may touch several sides, returns one collider a
  // side.
  virtual std::vector<std::unique_ptr<Collider>> sides() { return {}; }

  // A note for the user, one sentence; may be empty.
  virtual std::string note() const { return {}; }
};

}  // namespace sim
