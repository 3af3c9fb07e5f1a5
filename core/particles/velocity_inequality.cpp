#include "core/particles/velocity_inequality.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

// Finds the sizes for which the planes of the subset are met exactly; false if their normals are
// dependent.
bool meet(const HalfSpace* planes, const int* members, int count, const Vec3& v, double* sizes) {
  // Cholesky factorisation of the Gram matrix of the normals.
  double l[3][3] = {}, y[3] = {};
  for (int i = 0; i < count; ++i) {
    const HalfSpace& plane = planes[members[i]];
    for (int j = 0; j <= i; ++j) {
      double sum = plane.normal.dot(planes[members[j]].normal);
      for (int k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
      if (i == j && !(sum > 1e-12)) return false;
      l[i][j] = i == j ? std::sqrt(sum) : sum / l[j][j];
    }
    double sum = plane.least - plane.normal.dot(v);
    for (int k = 0; k < i; ++k) sum -= l[i][k] * y[k];
    y[i] = sum / l[i][i];
  }
  // With `i-- > 0` gcc 12 drops this loop at -O2, as it miscounts the inner one.
  for (int i = count - 1; i >= 0; --i) {
    double sum = y[i];
    for (int k = i + 1; k < count; ++k) sum -= l[k][i] * sizes[k];
    sizes[i] = sum / l[i][i];
  }
  return true;
}

// Tolerance for the rounding of a velocity.
double slack_of(const HalfSpace& plane, const Vec3& v) {
  return 1e-13 * (std::fabs(plane.least) + v.norm());
}

}  // namespace

// Active sets are tried from the smallest on.
NearestPoint nearest_point(const HalfSpace* planes, int count, unsigned considered, const Vec3& v) {
  static constexpr unsigned kSubsets[] = {0, 1, 2, 4, 3, 5, 6, 7};  // by their size
  NearestPoint best{.point = v, .miss = HUGE_VAL};
  for (const unsigned subset : kSubsets) {
    if ((subset & considered) != subset || subset >> count) continue;
    int members[3] = {}, size = 0;
    for (int k = 0; k < count; ++k)
      if (subset >> k & 1) members[size++] = k;
    double sizes[3] = {};
    if (!meet(planes, members, size, v, sizes)) continue;
    NearestPoint trial{.point = v, .active = subset};
    bool pulls = false;
    for (int i = 0; i < size; ++i) {
      pulls = pulls || sizes[i] < 0;
      trial.sizes[members[i]] = sizes[i];
      trial.point += sizes[i] * planes[members[i]].normal;
    }
    if (pulls) continue;
    double& miss = trial.miss;
    for (int k = 0; k < count; ++k)
      if ((considered >> k & 1) && !(subset >> k & 1))
        miss = std::fmax(miss, planes[k].least - planes[k].normal.dot(trial.point));
    if (miss < best.miss) best = trial;
    if (miss <= 1e-15 * (std::fabs(v[0]) + std::fabs(v[1]) + std::fabs(v[2]))) break;
  }
  return best;
}

Vec3 VelocityInequality::nearest(const Vec3& v) {
  at = 0;
  if (sticking) return held;
  const Vec3 point = nearest_point(planes, count, (1u << count) - 1, v).point;
  for (int k = 0; k < count; ++k) {
    if (planes[k].normal.dot(point) - planes[k].least <= slack_of(planes[k], point)) at |= 1u << k;
  }
  return point;
}

Vec3 VelocityInequality::projected_gradient(const Vec3& gradient, const Vec3& v) {
  friction = friction_model.at(v);
  const Vec3 all = gradient + friction;
  if (sticking) {
    active = kSticking;
    offset = Vec3::Zero();
    free_directions = Mat3::Zero();
    push = all;
    return Vec3::Zero();
  }
  // -left is the feasible direction nearest to -gradient.
  HalfSpace directions[kMost];
  for (int k = 0; k < count; ++k) directions[k] = {planes[k].normal, 0};
  const NearestPoint found = nearest_point(directions, count, at, -all);
  active = found.active;
  offset = Vec3::Zero();
  push = all + found.point;
  std::copy(found.sizes, found.sizes + kMost, pushes);
  find_free_directions();
  return -found.point;
}

void VelocityInequality::find_free_directions() {
  free_directions = Mat3::Identity();
  Vec3 basis[kMost];
  int size = 0;
  for (int k = 0; k < count; ++k) {
    if (!(active >> k & 1)) continue;
    Vec3 e = planes[k].normal;
    for (int j = 0; j < size; ++j) e -= e.dot(basis[j]) * basis[j];
    basis[size++] = e = e.normalized();
    free_directions -= outer(e, e);
  }
}

bool VelocityInequality::activates(const Vec3& v, const Vec3& d) {
  if (sticking) return false;
  const Vec3 end = v + d;
  unsigned caught = active;
  for (int k = 0; k < count; ++k)
    if (planes[k].normal.dot(end) < planes[k].least - slack_of(planes[k], end)) caught |= 1u << k;
  if (caught == active) return false;
  int members[kMost], size = 0;
  for (int k = 0; k < count; ++k)
    if (caught >> k & 1) members[size++] = k;
  double sizes[kMost] = {};
  if (!meet(planes, members, size, v, sizes)) return false;  // as good as among the others
  active = caught;
  offset = Vec3::Zero();
  for (int i = 0; i < size; ++i) offset += sizes[i] * planes[members[i]].normal;
  find_free_directions();
  return true;
}

}  // namespace sim
