#include "core/particles/contacts.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr double kNone = 2;       // beyond the step: no contact
constexpr int kMostTouches = 8;   // of one particle in one step
constexpr int kMostBounces = 64;  // off one collider in one step
constexpr int kRounds = 100;      // of pushing out of several colliders by turns

double slack(const Vec3& x) { return Contacts::slack(x); }

// The root of a switching function: outside(s) is true at `yes` and false at `no` (bisection).
template <class Outside>
double turning_point(double yes, double no, const Outside& outside) {
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = 0.5 * (yes + no);
    (outside(middle) ? yes : no) = middle;
  }
  return no;
}

// The root of the gap between a positive value at `outside` and a negative one at `inside`: false
// position with halved values (the Illinois method; Dowell & Jarratt 1971, BIT 11, 168).
template <class Gap>
double root(double outside, double positive, double inside, double negative, double least,
            const Gap& gap_at) {
  for (int n = 0, side = 0; n < 60 && negative < -least; ++n) {
    // Every fourth iteration is a bisection, which bounds the number of iterations for any shape.
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

// The time of impact of a path with a collider, as a share of the step, and the collider sampled at
// the start and at the end of the path.
struct FirstTouch {
  double s = kNone;
  SurfaceSample start, end;
};

// The share of a step at which a path that leaves a surface turns back to it, by the normal at the
// start and velocities of the surface between those at both ends: the first root of
//   n.(p' - h w) = a + b s + c s^2,  a > 0
// Before that it touches no flat or convex surface. kNone: it does not turn back.
double turn_back(const StepPath& path, double h, const SurfaceSample& start,
                 const SurfaceSample& end) {
  const double a = start.normal.dot(path.c[1] - h * start.velocity);
  const double b = start.normal.dot(2 * path.c[2] - h * (end.velocity - start.velocity));
  const double c = 3 * start.normal.dot(path.c[3]), square = b * b - 4 * a * c;
  const double divisor = square < 0 ? 0 : std::sqrt(square) - b;
  return divisor > 0 && 2 * a < divisor ? 2 * a / divisor : kNone;
}

// Finds the first contact of a path that begins outside the collider or on it.
FirstTouch first_touch(const Collider& collider, double t, double h, const StepPath& path) {
  FirstTouch found{kNone, collider.query(t, path.c[0]), collider.query(t + h, path.at(1))};
  const auto at = [&found](double s) {
    found.s = s;
    return found;
  };
  const auto gap_at = [&](double s) { return collider.query(t + s * h, path.at(s)).gap; };
  const auto closing = [&](double s) {
    const SurfaceSample sample = collider.query(t + s * h, path.at(s));
    return (path.rate(s) - h * sample.velocity).dot(sample.normal) < 0;
  };
  const double start = found.start.gap, end = found.end.gap;
  const double reach = path.length() + h * collider.max_speed(t, t + h);
  if (end > 0 && start > 0 && reach < start + end) return found;

  double outside = 0, inside = 1;  // places known to be, and the gaps there
  double positive = start, negative = end;
  // Sphere tracing from `outside` on: the gap is a free distance in every direction. True if it
  // touches; false at the end of the path, or where it comes too near to get on.
  const auto trace = [&] {
    constexpr int kSteps = 32;
    double gap = positive;
    for (int step = 0; step < kSteps; ++step) {
      const double s = outside + gap / reach;
      if (!(s < 1)) break;
      gap = gap_at(s);
      if (gap <= slack(path.at(s))) {
        inside = s;
        return true;
      }
      outside = s;
      positive = gap;
      if (end < 0) break;  // the root is between
    }
    return false;
  };
  if (start <= slack(path.c[0])) {
    // A particle on the surface that leaves it may return within the step, but not at once.
    const double outward = (path.c[1] - h * found.start.velocity).dot(found.start.normal);
    if (outward <= (end < 0 ? -kMinFlightTime * end : 0)) return at(0);
    const double turn = end < 0 ? 0.5 : turn_back(path, h, found.start, found.end);
    if (turn > 1 || (end >= 0 && closing(1))) return found;
    for (outside = turn; (positive = gap_at(outside)) <= 0; outside *= 0.5)
      if (outside < 1e-12) return at(0);
    if (end >= 0 && trace()) return at(inside);
  } else if (trace() && end >= 0) {
    return at(inside);
  }
  inside = 1;
  if (end >= 0) {
    if (closing(1)) return found;
    if (!closing(outside)) {
      // It leaves a surface that is too near for the trace to get on.
      const double turn = turn_back(path, h, found.start, found.end);
      if (outside + positive / reach >= 1 || turn <= outside || turn > 1) return found;
      outside = turn;
      if ((positive = gap_at(turn)) <= 0) return found;
      if (trace()) return at(inside);
      inside = 1;
      if (!closing(outside)) return found;
    }
    // A path that approaches and recedes again is nearest where its closing speed changes sign.
    inside = turning_point(outside, 1, closing);
    negative = gap_at(inside);
    if (!(negative < 0)) return found;
  }
  return at(root(outside, positive, inside, negative, 1e-4 * slack(path.c[0]), gap_at));
}

// Applies restitution and friction of an impact at share s of a step of length h; surface_rate is
// the velocity of the surface in m/step. The laws take the speeds before the impact, in m/s.
void bounce(const ContactMaterial& surface, double h, const Vec3& surface_rate, const Vec3& normal,
            double s, StepPath& path) {
  const Vec3 before = path.rate(s), relative = before - surface_rate;
  const double inward = relative.dot(normal);
  if (!(inward < 0)) return;
  const double push = -(1 + surface.restitution_at(-inward / h)) * inward;
  Vec3 change = push * normal;
  if (surface.friction > 0) {
    const Vec3 slip = relative - inward * normal;
    change -= within_cone(slip, surface.friction_at(slip.norm() / h) * push);
  }
  path.kick(s, change);
  path.touched = true;
  path.work.given += change.dot(surface_rate);
  path.work.lost += change.dot(surface_rate - before - 0.5 * change);
}

// The resting contact of a particle with one collider from share s of its path on.
class Hold {
 public:
  Hold(const Collider& collider, double t, double h, double s, const SurfaceSample& sample,
       const SurfaceSample& end, StepPath& path)
      : collider_(collider),
        way_(path),
        end_(end),
        t_(t),
        h_(h),
        s_(s),
        rest_(1 - s),
        normal_(sample.normal),
        from_(path.at(s)),
        rate_(path.rate(s)),
        surface_rate_(h * sample.velocity),
        surface_(collider.material()),
        friction_(surface_.friction) {}

  void press();

 private:
  bool slides();  // through all of the rest
  void come_to_rest();
  void press_along(const Vec3& direction);

  const Collider& collider_;
  StepPath& way_;
  const SurfaceSample end_;  // the surface at the former end of the path
  double t_, h_, s_, rest_;
  Vec3 normal_, from_, rate_, surface_rate_;  // at the contact; rates in m/step
  const ContactMaterial surface_;
  double friction_;                      // at the slip where it is touched
  Vec3 slip_{0, 0, 0}, drive_{0, 0, 0};  // tangential velocity, and its acceleration
  double speed_ = 0, pressure_ = 0;      // |slip|; of the surface, m/step^2
};

// Places the end of the path on the surface by a constant acceleration over the rest of the step,
//   A = lambda (n - mu tau),  tau: the direction of the slip
void Hold::press() {
  way_.resting = true;
  if (rest_ < 1e-6) return;  // pushed out later
  const Vec3 velocity_change = way_.velocity_change, moved = way_.moved, end_rate = way_.rate(1);
  if (friction_ > 0 && !slides())
    come_to_rest();
  else
    press_along(friction_ == 0 ? normal_ : Vec3(normal_ - friction_ / speed_ * slip_));

  // The change of the energy at the end, where a is the mean acceleration over the rest of the
  // step:
  //   |v + kick|^2 / 2 - |v|^2 / 2 - a.move
  const Vec3 kick = way_.velocity_change - velocity_change, free = (end_rate - rate_) / rest_;
  const double gain = kick.dot(end_rate + 0.5 * kick) - free.dot(way_.moved - moved);
  way_.work.given += kick.dot(surface_rate_);
  way_.work.lost += kick.dot(surface_rate_) - gain;
}

// The slip w obeys w' = drive - mu lambda w/|w|; true if it lasts to the end of the step.
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

// The slip ends within the step; then the particle sticks, or slips in the direction of the drive.
void Hold::come_to_rest() {
  const double static_limit = surface_.friction * pressure_;
  double braking = friction_ * pressure_;
  Vec3 path{0, 0, 0}, slip{0, 0, 0}, against{0, 0, 0};
  double after = rest_;
  if (speed_ > 0) {
    const double time = speed_ / (braking - drive_.dot(slip_) / speed_);
    path = 0.5 * time * slip_;
    after -= time;
  }
  const double drive = drive_.norm();
  const bool goes_on = drive > static_limit;
  if (goes_on) {
    // The friction coefficient is that of half the slip speed at the end of the step.
    const double speed = 0.5 * after * (drive - static_limit) / h_;
    braking = std::min(drive, surface_.friction_at(speed) * pressure_);
    slip = (1 - braking / drive) * after * drive_;
    path += 0.5 * after * slip;
    against = braking * 0.5 * rest_ / drive * drive_;
  }
  Vec3 place = collider_.advect(t_ + s_ * h_, t_ + h_, from_) + path;
  const SurfaceSample end = collider_.query(t_ + h_, place);
  if (std::fabs(end.gap) > slack(place)) place -= end.gap * end.normal;

  const Vec3 press = 2 / (rest_ * rest_) * (place - way_.at(1));
  way_.press(s_, press);
  if (goes_on) {  // without the friction that constrain_velocity() will apply
    const Vec3 now = way_.rate(1) - 0.5 * rest_ * press - h_ * end.velocity;
    way_.velocity_change += slip + against - tangential(now, end.normal);
    return;
  }
  way_.sticking = true;
  way_.held = place;
}

void Hold::press_along(const Vec3& direction) {
  constexpr int kIterations = 8;
  SurfaceSample now = end_;
  for (int n = 0; n < kIterations; ++n) {
    const double along = std::max(direction.dot(now.normal), 0.1);
    way_.press(s_, -2 * now.gap / (rest_ * rest_ * along) * direction);
    const Vec3 place = way_.at(1);
    now = collider_.query(t_ + h_, place);
    if (std::fabs(now.gap) <= 0.1 * slack(place)) return;
  }
}

// Follows a particle that has bounced and would be inside at the end of the step. Near the surface
//   gap(u) = a u - (a r - gap(r)) (u / r)^2,  0 <= u <= r,
// so that its flight lasts a r^2 / (a r - gap(r)) steps. Bounces that become shorter and shorter
// end in rest.
void bounce_until_rest(const Collider& collider, double t, double h, FirstTouch last,
                       StepPath& path) {
  for (int n = 0; n < kMostBounces && !path.once; ++n) {
    const double rest = 1 - last.s;
    const double leaving = (path.rate(last.s) - h * last.start.velocity).dot(last.start.normal);
    if (!(leaving * rest * rest >= kShortestFlight * (leaving * rest - last.end.gap))) break;
    const FirstTouch next = first_touch(collider, t + last.s * h, rest * h, path.from(last.s));
    if (!(next.s > 0 && next.s <= 1)) break;
    last.s += rest * next.s;
    last.start = collider.query(t + last.s * h, path.at(last.s));
    bounce(collider.material(), h, h * last.start.velocity, last.start.normal, last.s, path);
    last.end = collider.query(t + h, path.at(1));
    if (!(last.end.gap < 0)) return;
  }
  Hold(collider, t, h, last.s, last.start, last.end, path).press();
}

}  // namespace

StepPath StepPath::from(double s) const {
  const double rest = 1 - s;
  return {{at(s), rest * rate(s), rest * rest * (c[2] + 3 * s * c[3]), rest * rest * rest * c[3]}};
}

void StepPath::shift(const Vec3& by) {
  c[0] += by;
  moved += by;
  held += by;
}

void StepPath::kick(double s, const Vec3& change) {
  c[0] -= s * change;
  c[1] += change;
  moved += (1 - s) * change;
  velocity_change += change;
  sticking = false;
}

void StepPath::press(double s, const Vec3& acceleration) {
  const double rest = 1 - s;
  c[0] += 0.5 * s * s * acceleration;
  c[1] -= s * acceleration;
  c[2] += 0.5 * acceleration;
  moved += 0.5 * rest * rest * acceleration;
  velocity_change += 0.5 * rest * acceleration;  // the other half by constrain_velocity()
  sticking = false;
}

bool Contacts::near(double t, double h, const Vec3& middle, const Vec3& half, double length) const {
  for (Collider* const collider : on_)
    if (!(collider->clearance(t + h, middle, half) > length + h * collider->max_speed(t, t + h)))
      return true;
  return false;
}

// Projects the end of the path onto the surface and applies the restitution there.
void Contacts::project(double t, double h, StepPath& path) const {
  for (Collider* const collider : on_) {
    const SurfaceSample end = collider->query(t + h, path.at(1));
    if (!(end.gap < 0)) continue;
    bounce(collider->material(), h, h * end.velocity, end.normal, 1, path);
    path.shift(-end.gap * end.normal);
    path.touched = true;
  }
  // The last collider may have pushed the particle into an earlier one.
  const double rounding = 1e3 * slack(path.at(1));
  if (path.touched && std::ranges::any_of(on_, [&](Collider* const collider) {
        return collider->query(t + h, path.at(1)).gap < -rounding;
      }))
    push_end_out(t + h, path);
}

// Moves the end of a path out of all colliders by turns.
void Contacts::push_end_out(double t, StepPath& path) const {
  double deepest = -1;
  for (int round = 0; round < kRounds && deepest < 0; ++round) {
    deepest = 0;
    for (Collider* const collider : on_) {
      const SurfaceSample end = collider->query(t, path.sticking ? path.held : path.at(1));
      if (!(end.gap < 0)) continue;
      deepest = std::min(deepest, end.gap);
      path.shift(-end.gap * end.normal);
      path.resting = true;
    }
  }
  path.over_constrained = deepest < -1e3 * slack(path.at(1));
  if (!path.over_constrained) return;
  const Vec3 before = path.sticking ? path.held : path.at(1);
  Vec3 place = before;
  path.over_constrained = !push_between(t, place);
  path.shift(place - before);
}

void Contacts::resolve(double t, double h, StepPath& path) const {
  if (accuracy_ == Accuracy::kProject) return project(t, h, path);
  const Collider* seen[kMostTouches];
  int touches = 0;
  while (touches < kMostTouches) {
    // Finds the first contact with a collider that has not been touched in this step.
    FirstTouch first;
    const Collider* hit = nullptr;
    for (Collider* const collider : on_) {
      if (std::find(seen, seen + touches, collider) != seen + touches) continue;
      const FirstTouch found = sim::first_touch(*collider, t, h, path);
      if (found.s >= first.s) continue;
      first = found;
      hit = collider;
    }
    if (!hit) break;
    seen[touches++] = hit;

    const Vec3 place = path.at(first.s);
    const SurfaceSample sample = first.s == 0 ? first.start : hit->query(t + first.s * h, place);
    const Vec3 moved = path.moved;
    if (sample.gap < -slack(place)) {  // put inside by a user: moved out, without velocity
      path.shift(-sample.gap * sample.normal);
      path.touched = true;
    }
    bounce(hit->material(), h, h * sample.velocity, sample.normal, first.s, path);
    const SurfaceSample end = path.moved == moved ? first.end : hit->query(t + h, path.at(1));
    if (end.gap < 0) bounce_until_rest(*hit, t, h, {first.s, sample, end}, path);
  }

  if (touches > 0) push_end_out(t + h, path);
  path.touched = path.touched || path.resting;
}

bool Contacts::resolve(double t, double h, int i, double mass, bool hold_too, StepPath& path,
                       Vec3& place, Vec3& velocity) const {
  resolve(t, h, path);
  if (!path.touched) return false;
  if (path.over_constrained) work_sums().refuse(i);
  place = path.sticking ? path.held : Vec3(place + path.moved);
  velocity += path.velocity_change / h;
  work_sums().enter(i, mass / (h * h), path.work);
  if (hold_too && path.resting) velocity = constrain_velocity(t + h, i, mass, place, velocity);
  return true;
}

Vec3 Contacts::constrain_velocity(double t, int i, double mass, const Vec3& x,
                                  const Vec3& v) const {
  ContactWork work;
  const Vec3 held = constrain_velocity(t, x, v, work);
  work_sums().enter(i, mass, work);
  return held;
}

double Contacts::first_touch(const Collider& collider, double t, double h, const StepPath& path) {
  return sim::first_touch(collider, t, h, path).s;
}

Vec3 Contacts::bounced(const Collider& collider, double t, const Vec3& x, const Vec3& v,
                       ContactWork& work) {
  StepPath path{{x, v, Vec3::Zero(), Vec3::Zero()}};
  const SurfaceSample sample = collider.query(t, x);
  bounce(collider.material(), 1, sample.velocity, sample.normal, 0, path);
  work.lost += path.work.lost;
  work.given += path.work.given;
  return v + path.velocity_change;
}

bool Contacts::impact(double t, double h, const StepPath& path, std::span<Collider* const> known,
                      Impact& impact) const {
  FirstTouch first;
  Collider* hit = nullptr;
  for (Collider* const collider : on_) {
    if (std::ranges::count(known, collider) > 0) continue;
    const FirstTouch found = sim::first_touch(*collider, t, h, path);
    if (found.s >= first.s) continue;
    first = found;
    hit = collider;
  }
  if (!hit) return false;
  StepPath bounced = path;
  const Vec3 place = path.at(first.s);
  const SurfaceSample sample = hit->query(t + first.s * h, place);
  impact = {.collider = hit, .s = first.s};
  if (sample.gap < -slack(place)) impact.shift = -sample.gap * sample.normal;
  impact.place = place + impact.shift;
  bounce(hit->material(), h, h * sample.velocity, sample.normal, first.s, bounced);
  impact.change = bounced.velocity_change - path.velocity_change;
  impact.work = bounced.work;
  return true;
}

double Contacts::slack(const Vec3& x) { return 1e-12 * position_scale(x); }

bool Contacts::push_out(double t, Vec3& x) const {
  double deepest = 0;
  for (int round = 0; round < kRounds; ++round) {
    deepest = 0;
    for (Collider* const collider : on_) {
      const SurfaceSample sample = collider->query(t, x);
      if (!(sample.gap < 0)) continue;
      deepest = std::min(deepest, sample.gap);
      x -= sample.gap * sample.normal;
    }
    if (deepest == 0) return true;
  }
  return deepest >= -1e3 * slack(x) || push_between(t, x);
}

Vec3 Contacts::constrain_velocity(double t, const Vec3& x, Vec3 v, ContactWork& work) const {
  bool inward = true;
  for (int round = 0; round < kRounds && inward; ++round) {
    inward = false;
    for (Collider* const collider : on_) {
      const SurfaceSample sample = collider->query(t, x);
      const Vec3 relative = v - sample.velocity;
      const double normal = relative.dot(sample.normal);
      if (sample.gap > slack(x) || !(normal < 0)) continue;
      const Vec3 before = v, slip = relative - normal * sample.normal;
      const ContactMaterial surface = collider->material();
      const double speed = slip.norm(), most = -normal * surface.friction;
      if (most > 0 && speed <= most)
        v = sample.velocity;
      else
        v -= normal * sample.normal +
             (most > 0 ? surface.braking(speed, -normal) / speed : 0) * slip;
      inward = inward || -normal > 1e-15 * (speed + sample.velocity.norm());  // more than rounding
      const Vec3 change = v - before;
      work.given += change.dot(sample.velocity);
      work.lost += change.dot(sample.velocity - 0.5 * (before + v));
    }
  }
  if (inward) lead_between(t, x, slack(x), v, work);
  return v;
}

}  // namespace sim
