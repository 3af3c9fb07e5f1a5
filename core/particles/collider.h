// Where particles may not go: a solid whose surface may move as a function of time.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/particles/contact_law.h"
#include "core/particles/plain_surface.h"
#include "core/particles/solid_shape.h"
#include "core/particles/view.h"

namespace sim {

// The surface as seen from one point.
struct Touch {
  double gap = 0;          // m, signed distance: < 0 inside
  Vec3 normal{0, 1, 0};    // outward, of length 1, defined everywhere
  Vec3 velocity{0, 0, 0};  // of the surface there, m/s
};

// What of v runs along a surface.
inline Vec3 tangential(const Vec3& v, const Vec3& normal) { return v - v.dot(normal) * normal; }

// A collider is a pure function of (t, x), as forces are.
class Collider {
 public:
  virtual ~Collider() = default;

  // Called once with the initial state; may allocate and may throw Error.
  virtual void bind(const ParticleView& /*initial*/) {}

  virtual Surface surface() const = 0;

  // How it is drawn at time t; without, it is not.
  virtual SolidShape shape(double /*t*/) const { return {}; }

  // From the point x at time t. The gap changes by at most the way between two points, so that it
  // bounds the way that is free.
  virtual Touch touch(double t, const Vec3& x) const = 0;

  // m, no more than the gap of any point of the box middle -+ half. Asked of all particles, many at
  // a time, in every step.
  virtual double clearance(double t, const Vec3& middle, const Vec3& half) const {
    return touch(t, middle).gap - half.norm();
  }

  // The same at time t as numbers, where it is one of these surfaces: for many points at a time.
  virtual PlainSurface plain(double /*t*/) const { return {}; }

  // False where nothing depends on t.
  virtual bool moves() const { return true; }

  // m/s, a bound on how fast the gap of a point at rest changes between two times.
  virtual double fastest(double /*t0*/, double /*t1*/) const { return 0; }

  // Where the point of the body that is at x goes from t0 to t1.
  virtual Vec3 carried(double t0, double t1, const Vec3& x) const {
    return x + (t1 - t0) * touch(0.5 * (t0 + t1), x).velocity;
  }

  // True where look() has to be called before anything is asked between two times: for what can be
  // evaluated on one thread only. It may throw Error{kScene}.
  virtual bool sampled() const { return false; }
  virtual void look(double /*t0*/, double /*t1*/) {}

  // A solid with inner edges, in which particles may touch several of its sides, is the colliders
  // that this returns, one a side.
  virtual std::vector<std::unique_ptr<Collider>> sides() { return {}; }

  // What a user should know of it, one sentence; may be empty.
  virtual std::string note() const { return {}; }
};

}  // namespace sim
