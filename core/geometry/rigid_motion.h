// The motion of a collider: a function of time.
#pragma once

#include "core/math/vec3.h"

namespace sim {

// The pose of a body: rotated about its center by an angle around `axis`, then moved to `center`.
struct Pose {
  Vec3 center{0, 0, 0}, velocity{0, 0, 0};  // m, m/s
  Vec3 axis{0, 1, 0};                       // of length 1
  double sine = 0, cosine = 1, rate = 0;    // of the angle; rad/s

  Vec3 turned(const Vec3& v) const { return turned(v, sine); }
  Vec3 turned_back(const Vec3& v) const { return turned(v, -sine); }
  // The velocity, m/s, of the point of the body that is at x.
  Vec3 velocity_at(const Vec3& x) const {
    return rate == 0 ? velocity : Vec3(velocity + rate * axis.cross(x - center));
  }

 private:
  // Rodrigues' formula.
  Vec3 turned(const Vec3& v, double s) const {
    if (s == 0 && cosine == 1) return v;
    return cosine * v + s * axis.cross(v) + (1 - cosine) * axis.dot(v) * axis;
  }
};

// Pure functions of time, shared by all bodies with the same motion.
class RigidMotion {
 public:
  virtual ~RigidMotion() = default;

  // The pose of a body whose center is at `center` when it is at rest. May throw Error{kScene} if
  // sampled().
  virtual Pose at(double t, const Vec3& center) const = 0;
  // Its center alone, where that takes less.
  virtual Vec3 center_at(double t, const Vec3& center) const { return at(t, center).center; }

  // Bounds at all times: of the center's velocity, m/s, and of |rate|, rad/s. Not used if
  // sampled().
  virtual double max_speed() const { return 0; }
  virtual double max_angular_speed() const { return 0; }

  // True if at() is called at the ends of steps only and on one thread, as for a function of a
  // scene: inside a step the center follows a cubic between them.
  virtual bool sampled() const { return false; }
  virtual bool rests() const { return false; }  // at one place, not turned, at all times
  // A note for the user; may be empty.
  virtual const char* note() const { return ""; }
};

}  // namespace sim
