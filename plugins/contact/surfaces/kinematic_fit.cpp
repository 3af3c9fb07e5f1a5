#include "kinematic_fit.h"

#include <algorithm>

namespace sim {
namespace {

constexpr double kLeastInertia = 1e-6;  // of the largest: no turn about a line that all lie on

// Solves M w = l for a positive definite symmetric matrix with the rows a, b, c.
Vec3 solved(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& l) {
  const Vec3 x = b.cross(c), y = c.cross(a), z = a.cross(b);
  return (x * l.x() + y * l.y() + z * l.z()) / a.dot(x);
}

}  // namespace

// u(p) = v + w x (p - c) + a (p - c), the best-fitting similarity, with each kinematic point
// weighted by 1 / distance^4: moving least squares (Schaefer, McPhail & Warren (2006), ACM Trans.
// Graph. 25(3), 533-540), for displacements instead of positions. c and v are means; w is the
// rotation of a body with the angular momentum of the displacements; a = sum r.u / sum r^2. Points
// of a rotating line have straight displacements that such a motion describes exactly, whatever the
// angle.
Vec3 KinematicFit::at(const Vec3& place) const {
  double nearest = HUGE_VAL;
  for (const KinematicPoint& kinematic : kinematic_) {
    const double square = (kinematic.place - place).squaredNorm();
    if (square == 0) return kinematic.displacement;
    nearest = std::min(nearest, square);
  }
  const auto weight = [&](const KinematicPoint& kinematic) {
    const double ratio = nearest / (kinematic.place - place).squaredNorm();
    return ratio * ratio;
  };
  double all = 0;
  Vec3 middle = Vec3::Zero(), mean = Vec3::Zero();
  for (const KinematicPoint& kinematic : kinematic_) {
    const double w = weight(kinematic);
    all += w;
    middle += w * (kinematic.place - place);
    mean += w * kinematic.displacement;
  }
  if (!(all > 0)) return Vec3::Zero();
  middle /= all;
  mean /= all;
  Vec3 rows[3], momentum = Vec3::Zero();
  double inertia = 0, spread = 0;
  for (const KinematicPoint& kinematic : kinematic_) {
    const double w = weight(kinematic);
    const Vec3 r = (kinematic.place - place) - middle;
    inertia += w * r.squaredNorm();
    for (std::size_t axis = 0; axis < 3; ++axis) rows[axis] -= (w * r[axis]) * r;
    momentum += w * r.cross(kinematic.displacement - mean);
    spread += w * r.dot(kinematic.displacement - mean);
  }
  if (!(inertia > 0)) return mean;
  for (std::size_t axis = 0; axis < 3; ++axis) rows[axis][axis] += (1 + kLeastInertia) * inertia;
  const Vec3 turn = solved(rows[0], rows[1], rows[2], momentum);
  return mean - turn.cross(middle) - spread / inertia * middle;
}

}  // namespace sim
