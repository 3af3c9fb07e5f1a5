// A prescribed vector as a function of time with its derivatives; the row of a distance from it.
#pragma once

#include <cmath>
#include <memory>

#include "core/geometry/rigid_motion.h"
#include "core/math/differences.h"
#include "core/particles/constraint.h"

namespace sim {

// The position of the center of a motion that rests at `center`, moved by `offset`. Derivatives are
// taken from nine of its values. For one thread.
class Driven {
 public:
  struct At {
    Vec3 x, v, a;
  };

  explicit Driven(std::shared_ptr<const RigidMotion> motion, const Vec3& center = Vec3::Zero(),
                  const Vec3& offset = Vec3::Zero())
      : motion_(std::move(motion)), center_(center), offset_(offset) {
    if (moves())
      points_ = NinePoints::best([&](double t) { return place(t); }, 0.5,
                                 [](const Vec3& d) { return d.norm(); });
  }

  bool moves() const { return !motion_->rests(); }
  Pose pose(double t) const {
    Pose pose = motion_->at(t, center_);
    pose.center += offset_;
    return pose;
  }
  Vec3 place(double t) const { return motion_->center_at(t, center_) + offset_; }
  At at(double t) const {
    if (!moves()) return {place(t), Vec3::Zero(), Vec3::Zero()};
    if (t == last_t_) return last_;
    const auto nine = points_.values([&](double s) { return place(s); }, t);
    last_t_ = t;
    return last_ = {nine.value, nine.first(), nine.second()};
  }

 private:
  std::shared_ptr<const RigidMotion> motion_;
  Vec3 center_, offset_;
  NinePoints points_;
  // Equations are evaluated several times at the same time, and a function of a scene takes long.
  mutable double last_t_ = std::nan("");
  mutable At last_;
};

// phi = (|d|^2 - R^2) / 2R of a particle that is d = x - c(t) from a center, with w = d'.
inline void write_radial_row(const Rows& rows, std::size_t row, const Vec3& d, const Vec3& w,
                             const Driven::At& center, double radius) {
  const double inverse = 1 / radius;
  rows.phi[row] = 0.5 * (d.squaredNorm() * inverse - radius);
  rows.gradient[row] = inverse * d;
  rows.drive[row] = -inverse * d.dot(center.v);
  rows.bias[row] = inverse * (w.squaredNorm() - d.dot(center.a));
}

}  // namespace sim
