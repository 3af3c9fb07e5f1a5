#include "core/particles/contacts.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/text.h"

namespace sim {
namespace {

constexpr double kNone = 2;      // a place on the way that is none
constexpr int kMostTouches = 8;  // of one particle in one step
constexpr int kRounds = 16;      // of pushing out of several colliders by turns

// A gap below which a particle lies on the surface, for the rounding of its coordinates.
double slack(const Vec3& x) {
  return 1e-12 * std::max({1.0, std::fabs(x[0]), std::fabs(x[1]), std::fabs(x[2])});
}

// Where outside(s) turns from true to false between two places.
template <class Outside>
double turning_point(double yes, double no, const Outside& outside) {
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = 0.5 * (yes + no);
    (outside(middle) ? yes : no) = middle;
  }
  return no;
}

// The first place where a way that begins outside touches the collider, or kNone.
double first_touch(const Collider& collider, double t, double h, const Way& way) {
  const auto gap_at = [&](double s) { return collider.touch(t + s * h, way.at(s)).gap; };
  const auto closing = [&](double s) {
    const Touch touch = collider.touch(t + s * h, way.at(s));
    return (way.rate(s) - h * touch.velocity).dot(touch.normal) < 0;
  };
  const double start = gap_at(0), end = gap_at(1);
  const double reach = way.length() + h * collider.fastest(t, t + h);
  if (end > 0 && start > 0 && reach < start + end) return kNone;

  double outside = 0, inside = 1;  // places known to be
  if (start <= slack(way.at(0))) {
    // It lies on the surface. On its way out it may come back within the step.
    const Touch touch = collider.touch(t, way.at(0));
    if ((way.rate(0) - h * touch.velocity).dot(touch.normal) <= 0) return 0;
    if (end >= 0) return kNone;
    for (outside = 0.5; gap_at(outside) <= 0; outside *= 0.5)
      if (outside < 1e-12) return 0;
  } else {
    // Sphere tracing: the gap is free in every direction.
    constexpr int kSteps = 32;
    double gap = start;
    for (int step = 0; step < kSteps; ++step) {
      const double s = outside + gap / reach;
      if (!(s < 1)) break;
      gap = gap_at(s);
      if (gap <= slack(way.at(s))) {
        if (end >= 0) return s;
        break;
      }
      outside = s;
    }
    if (end >= 0) {
      // What comes near and goes away again is nearest in between.
      if (!closing(outside) || closing(1)) return kNone;
      inside = turning_point(outside, 1, closing);
      if (!(gap_at(inside) < 0)) return kNone;
    }
  }
  return turning_point(outside, inside, [&](double s) { return gap_at(s) > 0; });
}

// Pressed on from s on: the end comes to lie on the surface.
void press_on(const Collider& collider, double t, double h, double s, const Vec3& normal,
              Way& way) {
  const double rest = 1 - s;
  way.pressed = true;
  if (rest < 1e-6) return;  // pushed out below
  constexpr int kIterations = 8;
  for (int n = 0; n < kIterations; ++n) {
    const Touch end = collider.touch(t + h, way.at(1));
    if (end.gap >= 0) return;
    const double along = std::max(normal.dot(end.normal), 0.1);
    way.press(s, -2 * end.gap / (rest * rest * along) * normal);
  }
}

}  // namespace

std::vector<Solid> Contacts::solids(double t) const {
  std::vector<Solid> list;
  for (const auto& collider : colliders_) list.push_back(collider->solid(t));
  return list;
}

void Way::shift(const Vec3& by) {
  c[0] += by;
  moved += by;
}

void Way::kick(double s, const Vec3& change) {
  c[0] -= s * change;
  c[1] += change;
  moved += (1 - s) * change;
  kicked += change;
}

void Way::press(double s, const Vec3& acceleration) {
  const double rest = 1 - s;
  c[0] += 0.5 * s * s * acceleration;
  c[1] -= s * acceleration;
  c[2] += 0.5 * acceleration;
  moved += 0.5 * rest * rest * acceleration;
  kicked += 0.5 * rest * acceleration;  // the other half by hold()
}

void Contacts::add(std::unique_ptr<Collider> collider, const std::string& name,
                   const ParticleView& initial) {
  collider->bind(initial);
  for (int i = 0; i < initial.n; ++i) {
    const Touch start = collider->touch(initial.t, initial.position(i));
    if (!initial.free(i) || start.gap >= -slack(initial.position(i))) continue;
    throw Error(ErrorKind::kScene, {"collider '" + name + "'", "",
                                    "particle " + std::to_string(i) + " starts " +
                                        brief(-start.gap, 3) + " m inside of it",
                                    "move the particle out, or pin it"});
  }
  colliders_.push_back(std::move(collider));
}

void Contacts::near(double t, double h, const ParticleView& end, Tile tile, double way,
                    std::uint8_t* near) const {
  for (const auto& collider : colliders_)
    collider->near(t + h, end, tile, way + h * collider->fastest(t, t + h), near);
}

void Contacts::settle(double t, double h, Way& way) const {
  const Collider* seen[kMostTouches];
  int touches = 0;
  while (touches < kMostTouches) {
    // The first touch of a collider that was not touched yet.
    double first = kNone;
    const Collider* hit = nullptr;
    for (const auto& collider : colliders_) {
      if (std::find(seen, seen + touches, collider.get()) != seen + touches) continue;
      const double s = first_touch(*collider, t, h, way);
      if (s >= first) continue;
      first = s;
      hit = collider.get();
    }
    if (!hit) break;
    seen[touches++] = hit;

    const Touch touch = hit->touch(t + first * h, way.at(first));
    if (touch.gap < -slack(way.at(first))) {  // put inside by hand: out of it, without velocity
      way.shift(-touch.gap * touch.normal);
      way.touched = true;
    }
    const double inward = (way.rate(first) - h * touch.velocity).dot(touch.normal);
    if (inward < 0) {
      way.kick(first, -(1 + hit->surface().restitution) * inward * touch.normal);
      way.touched = true;
    }
    if (hit->touch(t + h, way.at(1)).gap < 0) press_on(*hit, t, h, first, touch.normal, way);
  }

  bool inside = touches > 0;
  for (int round = 0; round < kRounds && inside; ++round) {
    inside = false;
    for (const auto& collider : colliders_) {
      const Touch end = collider->touch(t + h, way.at(1));
      if (!(end.gap < 0)) continue;
      way.shift(-end.gap * end.normal);
      way.pressed = inside = true;
    }
  }
  way.touched = way.touched || way.pressed;
}

Vec3 Contacts::hold(double t, const Vec3& x, Vec3 v) const {
  bool inward = true;
  for (int round = 0; round < kRounds && inward; ++round) {
    inward = false;
    for (const auto& collider : colliders_) {
      const Touch touch = collider->touch(t, x);
      const double normal = (v - touch.velocity).dot(touch.normal);
      if (touch.gap > slack(x) || !(normal < 0)) continue;
      v -= normal * touch.normal;
      inward = true;
    }
  }
  return v;
}

}  // namespace sim
