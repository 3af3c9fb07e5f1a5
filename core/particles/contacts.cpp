#include "core/particles/contacts.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr double kNone = 2;      // a place on the way that is none
constexpr int kMostTouches = 8;  // of one particle in one step
constexpr int kRounds = 100;     // of pushing out of several colliders by turns

double slack(const Vec3& x) { return Contacts::slack(x); }

// Where outside(s) turns from true to false between two places.
template <class Outside>
double turning_point(double yes, double no, const Outside& outside) {
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = 0.5 * (yes + no);
    (outside(middle) ? yes : no) = middle;
  }
  return no;
}

// Where a gap that is positive at one place and not at another turns 0 between them: the method of
// false position with halved values (Illinois; Dowell & Jarratt 1971, BIT 11, 168).
template <class Gap>
double root(double outside, double positive, double inside, double negative, double least,
            const Gap& gap_at) {
  for (int n = 0, side = 0; n < 60 && negative < -least; ++n) {
    // Every fourth time by halves, so that no shape is slow.
    double s = n % 4 == 3 ? 0.5 * (outside + inside)
                          : (outside * -negative + inside * positive) / (positive - negative);
    if (!(s > outside && s < inside)) s = 0.5 * (outside + inside);
    const double gap = gap_at(s);
    if (gap > 0) {
      outside = s;
      positive = gap;
      if (side > 0) negative *= 0.5;
      side = 1;
      if (gap <= least) return s;
    } else {
      inside = s;
      negative = gap;
      if (side < 0) positive *= 0.5;
      side = -1;
    }
  }
  return inside;
}

// Where a way first touches a collider, and the collider as seen from its start and its end.
struct FirstTouch {
  double s = kNone;
  Touch start, end;
};

// Of a way that begins outside.
FirstTouch first_touch(const Collider& collider, double t, double h, const Way& way) {
  FirstTouch found{kNone, collider.touch(t, way.c[0]), collider.touch(t + h, way.at(1))};
  const auto at = [&found](double s) {
    found.s = s;
    return found;
  };
  const auto gap_at = [&](double s) { return collider.touch(t + s * h, way.at(s)).gap; };
  const auto closing = [&](double s) {
    const Touch touch = collider.touch(t + s * h, way.at(s));
    return (way.rate(s) - h * touch.velocity).dot(touch.normal) < 0;
  };
  const double start = found.start.gap, end = found.end.gap;
  const double reach = way.length() + h * collider.fastest(t, t + h);
  if (end > 0 && start > 0 && reach < start + end) return found;

  double outside = 0, inside = 1;  // places known to be, and the gaps there
  double positive = start, negative = end;
  if (start <= slack(way.c[0])) {
    // It lies on the surface. On its way out it may come back within the step, but not at once.
    const double outward = (way.c[1] - h * found.start.velocity).dot(found.start.normal);
    if (outward <= (end < 0 ? -kAnInstant * end : 0)) return at(0);
    if (end >= 0) return found;
    for (outside = 0.5; (positive = gap_at(outside)) <= 0; outside *= 0.5)
      if (outside < 1e-12) return at(0);
  } else {
    // Sphere tracing: the gap is free in every direction.
    constexpr int kSteps = 32;
    double gap = start;
    for (int step = 0; step < kSteps; ++step) {
      const double s = outside + gap / reach;
      if (!(s < 1)) break;
      gap = gap_at(s);
      if (gap <= slack(way.at(s))) {
        if (end >= 0) return at(s);
        break;
      }
      outside = s;
      positive = gap;
      if (end < 0) break;  // the root is between
    }
    if (end >= 0) {
      // What comes near and goes away again is nearest in between.
      if (!closing(outside) || closing(1)) return found;
      inside = turning_point(outside, 1, closing);
      negative = gap_at(inside);
      if (!(negative < 0)) return found;
    }
  }
  return at(root(outside, positive, inside, negative, 1e-4 * slack(way.c[0]), gap_at));
}

// The restitution and the friction of a blow in a step of h, at the velocity that a surface has in
// m/step; laws are asked at the speeds before it.
void bounce(const Surface& surface, double h, const Vec3& surface_rate, const Vec3& normal,
            double s, Way& way) {
  const Vec3 before = way.rate(s), relative = before - surface_rate;
  const double inward = relative.dot(normal);
  if (!(inward < 0)) return;
  const double push = -(1 + surface.restitution_at(-inward / h)) * inward;
  Vec3 change = push * normal;
  if (surface.friction > 0) {
    const Vec3 slip = relative - inward * normal;
    change -= within_cone(slip, surface.friction_at(slip.norm() / h) * push);
  }
  way.kick(s, change);
  way.touched = true;
  way.work.given += change.dot(surface_rate);
  way.work.lost += change.dot(surface_rate - before - 0.5 * change);
}

// One collider that holds a particle from a place of its way on.
class Hold {
 public:
  Hold(const Collider& collider, double t, double h, double s, const Touch& touch, const Touch& end,
       Way& way)
      : collider_(collider),
        way_(way),
        end_(end),
        t_(t),
        h_(h),
        s_(s),
        rest_(1 - s),
        normal_(touch.normal),
        from_(way.at(s)),
        rate_(way.rate(s)),
        surface_rate_(h * touch.velocity),
        surface_(collider.surface()),
        friction_(surface_.friction) {}

  void press();

 private:
  bool slides();  // through all of the rest
  void come_to_rest();
  void press_along(const Vec3& direction);

  const Collider& collider_;
  Way& way_;
  const Touch end_;  // where the way ended before
  double t_, h_, s_, rest_;
  Vec3 normal_, from_, rate_, surface_rate_;  // where it is touched; in m/step
  const Surface surface_;
  double friction_;                      // at the slip where it is touched
  Vec3 slip_{0, 0, 0}, drive_{0, 0, 0};  // tangential velocity and what accelerates it
  double speed_ = 0, pressure_ = 0;      // |slip|; of the surface, m/step^2
};

// The end comes to lie on the surface by a constant acceleration of the rest,
//   A = lambda (n - mu tau),  tau: the direction of the slip
void Hold::press() {
  way_.pressed = true;
  if (rest_ < 1e-6) return;  // pushed out later
  const Vec3 kicked = way_.kicked, moved = way_.moved, end_rate = way_.rate(1);
  if (friction_ > 0 && !slides())
    come_to_rest();
  else
    press_along(friction_ == 0 ? normal_ : Vec3(normal_ - friction_ / speed_ * slip_));

  // What that changes of the energy at the end, under the mean acceleration a of the rest:
  //   |v + kick|^2 / 2 - |v|^2 / 2 - a.move
  const Vec3 kick = way_.kicked - kicked, free = (end_rate - rate_) / rest_;
  const double gain = kick.dot(end_rate + 0.5 * kick) - free.dot(way_.moved - moved);
  way_.work.given += kick.dot(surface_rate_);
  way_.work.lost += kick.dot(surface_rate_) - gain;
}

// The slip w obeys w' = drive - mu lambda w/|w|.
bool Hold::slides() {
  slip_ = tangential(rate_ - surface_rate_, normal_);
  drive_ =
      tangential((way_.rate(1) - rate_ - (h_ * end_.velocity - surface_rate_)) / rest_, normal_);
  speed_ = slip_.norm();
  if (speed_ <= 1e-14 * (rate_.norm() + surface_rate_.norm())) speed_ = 0;
  pressure_ =
      std::max(0.0, -2 * end_.gap / (rest_ * rest_ * std::max(normal_.dot(end_.normal), 0.1)));
  if (speed_ == 0) return false;
  friction_ = surface_.friction_at(speed_ / h_);
  return speed_ + rest_ * (drive_.dot(slip_) / speed_ - friction_ * pressure_) >= 0;
}

// It stops within the step, and stays where it is on the surface or turns round.
void Hold::come_to_rest() {
  const double holding = surface_.friction * pressure_;
  double braking = friction_ * pressure_;
  Vec3 way{0, 0, 0}, slip{0, 0, 0}, against{0, 0, 0};
  double after = rest_;
  if (speed_ > 0) {
    const double time = speed_ / (braking - drive_.dot(slip_) / speed_);
    way = 0.5 * time * slip_;
    after -= time;
  }
  const double drive = drive_.norm();
  const bool goes_on = drive > holding;
  if (goes_on) {
    // With the friction of half the slip that it comes to.
    const double speed = 0.5 * after * (drive - holding) / h_;
    braking = std::min(drive, surface_.friction_at(speed) * pressure_);
    slip = (1 - braking / drive) * after * drive_;
    way += 0.5 * after * slip;
    against = braking * 0.5 * rest_ / drive * drive_;
  }
  Vec3 place = collider_.carried(t_ + s_ * h_, t_ + h_, from_) + way;
  const Touch end = collider_.touch(t_ + h_, place);
  if (std::fabs(end.gap) > slack(place)) place -= end.gap * end.normal;

  const Vec3 press = 2 / (rest_ * rest_) * (place - way_.at(1));
  way_.press(s_, press);
  if (goes_on) {  // what hold() will take off for friction is left in
    const Vec3 now = way_.rate(1) - 0.5 * rest_ * press - h_ * end.velocity;
    way_.kicked += slip + against - tangential(now, end.normal);
    return;
  }
  way_.stuck = true;
  way_.held = place;
}

void Hold::press_along(const Vec3& direction) {
  constexpr int kIterations = 8;
  Touch now = end_;
  for (int n = 0; n < kIterations; ++n) {
    const double along = std::max(direction.dot(now.normal), 0.1);
    way_.press(s_, -2 * now.gap / (rest_ * rest_ * along) * direction);
    const Vec3 place = way_.at(1);
    now = collider_.touch(t_ + h_, place);
    if (std::fabs(now.gap) <= 0.1 * slack(place)) return;
  }
}

}  // namespace

void Way::shift(const Vec3& by) {
  c[0] += by;
  moved += by;
  held += by;
}

void Way::kick(double s, const Vec3& change) {
  c[0] -= s * change;
  c[1] += change;
  moved += (1 - s) * change;
  kicked += change;
  stuck = false;
}

void Way::press(double s, const Vec3& acceleration) {
  const double rest = 1 - s;
  c[0] += 0.5 * s * s * acceleration;
  c[1] -= s * acceleration;
  c[2] += 0.5 * acceleration;
  moved += 0.5 * rest * rest * acceleration;
  kicked += 0.5 * rest * acceleration;  // the other half by hold()
  stuck = false;
}

bool Contacts::near(double t, double h, const Vec3& middle, const Vec3& half, double length) const {
  for (Collider* const collider : on_)
    if (!(collider->clearance(t + h, middle, half) > length + h * collider->fastest(t, t + h)))
      return true;
  return false;
}

// Back to the surface at the end, with the bounce there.
void Contacts::project(double t, double h, Way& way) const {
  for (Collider* const collider : on_) {
    const Touch end = collider->touch(t + h, way.at(1));
    if (!(end.gap < 0)) continue;
    bounce(collider->surface(), h, h * end.velocity, end.normal, 1, way);
    way.shift(-end.gap * end.normal);
    way.touched = true;
  }
}

void Contacts::settle(double t, double h, Way& way) const {
  if (accuracy_ == Accuracy::kProject) return project(t, h, way);
  const Collider* seen[kMostTouches];
  int touches = 0;
  while (touches < kMostTouches) {
    // The first touch of a collider that was not touched yet.
    FirstTouch first;
    const Collider* hit = nullptr;
    for (Collider* const collider : on_) {
      if (std::find(seen, seen + touches, collider) != seen + touches) continue;
      const FirstTouch found = sim::first_touch(*collider, t, h, way);
      if (found.s >= first.s) continue;
      first = found;
      hit = collider;
    }
    if (!hit) break;
    seen[touches++] = hit;

    const Vec3 place = way.at(first.s);
    const Touch touch = first.s == 0 ? first.start : hit->touch(t + first.s * h, place);
    const Vec3 moved = way.moved;
    if (touch.gap < -slack(place)) {  // put inside by hand: out of it, without velocity
      way.shift(-touch.gap * touch.normal);
      way.touched = true;
    }
    bounce(hit->surface(), h, h * touch.velocity, touch.normal, first.s, way);
    const Touch end = way.moved == moved ? first.end : hit->touch(t + h, way.at(1));
    if (end.gap < 0) Hold(*hit, t, h, first.s, touch, end, way).press();
  }

  bool inside = touches > 0;
  for (int round = 0; round < kRounds && inside; ++round) {
    inside = false;
    for (Collider* const collider : on_) {
      const Touch end = collider->touch(t + h, way.stuck ? way.held : way.at(1));
      if (!(end.gap < 0)) continue;
      way.squeezed = end.gap < -1e3 * slack(way.at(1));
      way.shift(-end.gap * end.normal);
      way.pressed = inside = true;
    }
  }
  way.squeezed = way.squeezed && inside;
  way.touched = way.touched || way.pressed;
}

bool Contacts::settle(double t, double h, int i, double mass, bool hold_too, Way& way, Vec3& place,
                      Vec3& velocity) const {
  settle(t, h, way);
  if (!way.touched) return false;
  if (way.squeezed) ledger().refuse(i);
  place = way.stuck ? way.held : Vec3(place + way.moved);
  velocity += way.kicked / h;
  ledger().enter(i, mass / (h * h), way.work);
  if (hold_too && way.pressed) velocity = hold(t + h, i, mass, place, velocity);
  return true;
}

Vec3 Contacts::hold(double t, int i, double mass, const Vec3& x, const Vec3& v) const {
  ContactWork work;
  const Vec3 held = hold(t, x, v, work);
  ledger().enter(i, mass, work);
  return held;
}

double Contacts::first_touch(const Collider& collider, double t, double h, const Way& way) {
  return sim::first_touch(collider, t, h, way).s;
}

Vec3 Contacts::bounced(const Collider& collider, double t, const Vec3& x, const Vec3& v,
                       ContactWork& work) {
  Way way{{x, v, Vec3::Zero(), Vec3::Zero()}};
  const Touch touch = collider.touch(t, x);
  bounce(collider.surface(), 1, touch.velocity, touch.normal, 0, way);
  work.lost += way.work.lost;
  work.given += way.work.given;
  return v + way.kicked;
}

bool Contacts::impact(double t, double h, const Way& way, std::span<Collider* const> known,
                      Impact& impact) const {
  FirstTouch first;
  Collider* hit = nullptr;
  for (Collider* const collider : on_) {
    if (std::ranges::count(known, collider) > 0) continue;
    const FirstTouch found = sim::first_touch(*collider, t, h, way);
    if (found.s >= first.s) continue;
    first = found;
    hit = collider;
  }
  if (!hit) return false;
  Way bounced = way;
  const Vec3 place = way.at(first.s);
  const Touch touch = hit->touch(t + first.s * h, place);
  impact = {.collider = hit, .s = first.s};
  if (touch.gap < -slack(place)) impact.shift = -touch.gap * touch.normal;
  impact.place = place + impact.shift;
  bounce(hit->surface(), h, h * touch.velocity, touch.normal, first.s, bounced);
  impact.change = bounced.kicked - way.kicked;
  impact.work = bounced.work;
  return true;
}

double Contacts::slack(const Vec3& x) { return 1e-12 * place_size(x); }

bool Contacts::push_out(double t, Vec3& x) const {
  double deepest = 0;
  for (int round = 0; round < kRounds; ++round) {
    deepest = 0;
    for (Collider* const collider : on_) {
      const Touch touch = collider->touch(t, x);
      if (!(touch.gap < 0)) continue;
      deepest = std::min(deepest, touch.gap);
      x -= touch.gap * touch.normal;
    }
    if (deepest == 0) return true;
  }
  return deepest >= -1e3 * slack(x);
}

Vec3 Contacts::hold(double t, const Vec3& x, Vec3 v, ContactWork& work) const {
  bool inward = true;
  for (int round = 0; round < kRounds && inward; ++round) {
    inward = false;
    for (Collider* const collider : on_) {
      const Touch touch = collider->touch(t, x);
      const Vec3 relative = v - touch.velocity;
      const double normal = relative.dot(touch.normal);
      if (touch.gap > slack(x) || !(normal < 0)) continue;
      const Vec3 before = v, slip = relative - normal * touch.normal;
      const Surface surface = collider->surface();
      const double speed = slip.norm(), most = -normal * surface.friction;
      if (most > 0 && speed <= most)
        v = touch.velocity;
      else
        v -=
            normal * touch.normal + (most > 0 ? surface.braking(speed, -normal) / speed : 0) * slip;
      inward = inward || -normal > 1e-15 * (speed + touch.velocity.norm());  // more than rounding
      const Vec3 change = v - before;
      work.given += change.dot(touch.velocity);
      work.lost += change.dot(touch.velocity - 0.5 * (before + v));
    }
  }
  return v;
}

}  // namespace sim
