#include "core/particles/prescribed_motion.h"

#include <cmath>
#include <string>

#include "core/base/assert.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/math/axes.h"

namespace sim {
namespace {

std::string text_of(const Vec3& x) {
  return "{" + brief(x[0]) + ", " + brief(x[1]) + ", " + brief(x[2]) + "}";
}

}  // namespace

void PrescribedMotion::add(int i, const Vec3& now, std::shared_ptr<const RigidMotion> motion) {
  constexpr double kNear = 1e-9;
  const Vec3 start = motion->at(0, now).center;
  Vec3 offset = Vec3::Zero();
  if (!motion->sampled())
    offset = now - start;
  else if (!((start - now).norm() <= kNear * (1 + now.norm())))
    throw Error(ErrorKind::kScene,
                {"bad lead", "",
                 "particle " + std::to_string(i) + " is at " + text_of(now) +
                     ", but its path begins at " + text_of(start),
                 "put the particle there, or let the path begin where the particle is"});
  SIM_ASSERT(std::ranges::count(ids_, i) == 0);
  ids_.push_back(i);
  paths_.emplace_back(std::move(motion), now, offset);
}

void PrescribedMotion::place(double t, const Axes& q, const Axes& v) const {
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    const Pose pose = paths_[k].pose(t);
    put_vector(q, ids_[k], pose.center);
    put_vector(v, ids_[k], pose.velocity);
  }
}

void PrescribedMotion::velocities(double t, const Axes& v) const {
  for (std::size_t k = 0; k < ids_.size(); ++k) put_vector(v, ids_[k], paths_[k].pose(t).velocity);
}

void PrescribedMotion::chords(double t, double d, const Axes& q, const Axes& v) const {
  SIM_ASSERT(d != 0);
  for (std::size_t k = 0; k < ids_.size(); ++k) {
    const int i = ids_[k];
    put_vector(v, i, (paths_[k].place(t + d) - Vec3(q[0][i], q[1][i], q[2][i])) / d);
  }
}

void PrescribedMotion::accelerate(double t, const Axes& a) const {
  for (std::size_t k = 0; k < ids_.size(); ++k) put_vector(a, ids_[k], paths_[k].at(t).a);
}

}  // namespace sim
