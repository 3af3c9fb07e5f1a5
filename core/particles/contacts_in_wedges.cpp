// Room between surfaces where pushing out of one by turns leads into the next.
#include <algorithm>

#include "core/particles/contacts.h"
#include "core/particles/velocity_inequality.h"

namespace sim {
namespace {

// The half-spaces of the surfaces that one particle touches.
struct ContactPlanes {
  static constexpr int kMost = 8;

  int count = 0;
  HalfSpace planes[kMost];
  Vec3 carriers[kMost];  // m/s, velocities of the surfaces

  void add(const SurfaceSample& sample, double least) {
    if (count == kMost) return;
    planes[count] = {sample.normal, least};
    carriers[count++] = sample.velocity;
  }
  double miss(const Vec3& v) const {
    double most = 0;
    for (int k = 0; k < count; ++k)
      most = std::max(most, planes[k].least - planes[k].normal.dot(v));
    return most;
  }
};

// A point in all half-spaces, and the velocities of the surfaces that push to it.
struct FeasiblePoint {
  NearestPoint nearest;
  Vec3 carriers[3];
  HalfSpace planes[3];
};

// The nearest point is that to three planes at most; false if none is in all up to `rounding`.
bool find_feasible(const ContactPlanes& touched, const Vec3& v, double rounding,
                   FeasiblePoint& found) {
  const int last = std::max(0, touched.count - 3);
  for (int i = 0; i <= last; ++i)
    for (int j = i + 1; j <= std::max(i + 1, touched.count - 2); ++j)
      for (int k = j + 1; k <= std::max(j + 1, touched.count - 1); ++k) {
        const int members[] = {i, j, k}, size = std::min(3, touched.count);
        for (int n = 0; n < size; ++n) {
          found.planes[n] = touched.planes[members[n]];
          found.carriers[n] = touched.carriers[members[n]];
        }
        found.nearest = nearest_point(found.planes, size, (1u << size) - 1, v);
        if (touched.miss(found.nearest.point) <= rounding) return true;
      }
  return false;
}

}  // namespace

bool Contacts::push_between(double t, Vec3& x) const {
  constexpr int kMostRounds = 20;  // on curved surfaces
  const double rounding = 1e3 * slack(x);
  Vec3 place = x;
  for (int round = 0; round < kMostRounds; ++round) {
    ContactPlanes touched;
    for (Collider* const collider : on_) {
      const SurfaceSample sample = collider->query(t, place);
      if (sample.gap <= slack(place)) touched.add(sample, -sample.gap);
    }
    if (touched.miss(Vec3::Zero()) <= rounding) {
      x = place;
      return true;
    }
    FeasiblePoint found;
    if (!find_feasible(touched, Vec3::Zero(), rounding, found)) return false;
    place += found.nearest.point;
  }
  return false;
}

bool Contacts::lead_between(double t, const Vec3& x, double reach, Vec3& v,
                            ContactWork& work) const {
  constexpr double kRounding = 1e-9;  // of velocities
  ContactPlanes touched;
  double fastest = v.norm();
  for (Collider* const collider : on_) {
    const SurfaceSample sample = collider->query(t, x);
    if (sample.gap > reach) continue;
    touched.add(sample, sample.normal.dot(sample.velocity));
    fastest = std::max(fastest, sample.velocity.norm());
  }
  if (touched.miss(v) <= kRounding * fastest) return true;
  FeasiblePoint found;
  if (!find_feasible(touched, v, kRounding * fastest, found)) return false;
  const Vec3 change = found.nearest.point - v;
  double given = 0;
  for (int k = 0; k < std::min(3, touched.count); ++k)
    given += found.nearest.sizes[k] * found.planes[k].normal.dot(found.carriers[k]);
  work.given += given;
  work.lost += given - change.dot(v + 0.5 * change);
  v = found.nearest.point;
  return true;
}

}  // namespace sim
