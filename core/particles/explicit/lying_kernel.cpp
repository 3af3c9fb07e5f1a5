#include "core/particles/explicit/lying.h"
#include "core/particles/way.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/particles/explicit/lying_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

// All sums and products are those of Vec3 and Way, in their order and never fused: the bits of
// Contacts.
using Point = V3<double>;
constexpr int kLying = 8;   // particles of an entry
constexpr int kRounds = 4;  // of what is iterated; others are for Contacts

SIM_INLINE Doubles number(double s) { return splat<double>(s); }
SIM_INLINE Doubles choose(Mask m, Doubles a, Doubles b) { return m ? a : b; }
SIM_INLINE Point choose(Mask m, const Point& a, const Point& b) {
  return {choose(m, a.x, b.x), choose(m, a.y, b.y), choose(m, a.z, b.z)};
}
SIM_INLINE Point operator+(const Point& a, const Point& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
SIM_INLINE Point operator*(Doubles s, const Point& a) { return {a.x * s, a.y * s, a.z * s}; }
SIM_INLINE Doubles dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
SIM_INLINE Doubles norm(const Point& a) { return square_root(dot(a, a)); }
SIM_INLINE Doubles size(Doubles v) { return v < Doubles{} ? -v : v; }
SIM_INLINE Doubles larger(Doubles a, Doubles b) { return a < b ? b : a; }  // std::max
SIM_INLINE Point all(const Vec3& v) { return {number(v[0]), number(v[1]), number(v[2])}; }
SIM_INLINE Doubles slack(const Point& x) {
  return number(1e-12) * larger(number(1), larger(larger(size(x.x), size(x.y)), size(x.z)));
}
SIM_INLINE void keep_as(double* const to[3], std::int64_t i, Mask m, const Point& v) {
  const Point now = choose(m, v, load(to, i));
  store(to[0] + i, now.x);
  store(to[1] + i, now.y);
  store(to[2] + i, now.z);
}
// `m` as lanes whose bits are set.
SIM_INLINE Mask mask_of(unsigned bits) { return keep(bits, number(1)) > Doubles{}; }

struct Seen {
  Doubles gap;
  Point normal;
};

// The surface as Solid::touch() sees it.
template <PlainSurface::Form kForm>
struct Surface {
  Point center, velocity, normal;
  Doubles radius, thickness, sign;

  SIM_INLINE explicit Surface(const PlainSurface& from)
      : center(all(from.center)),
        velocity(all(from.velocity)),
        normal(all(from.normal)),
        radius(number(from.radius)),
        thickness(number(from.thickness)),
        sign(number(from.inside ? -1 : 1)) {}

  SIM_INLINE Doubles gap(const Point& x) const {
    const Point d = x - center;
    const Doubles from = kForm == PlainSurface::Form::kPlane ? dot(normal, d) : norm(d);
    return sign * (from - radius) - thickness;
  }
  SIM_INLINE Seen touch(const Point& x) const {
    const Point d = x - center;
    if constexpr (kForm == PlainSurface::Form::kPlane)
      return {sign * (dot(normal, d) - radius) - thickness, sign * normal};
    const Doubles length = norm(d), zero{};
    const Mask off = length > zero;
    const Point outward = {d.x / length, d.y / length, d.z / length};
    return {sign * (length - radius) - thickness,
            sign * choose(off, outward, {zero, number(1), zero})};
  }
};

// As Way.
struct Ways {
  Point c[4], moved, kicked;

  SIM_INLINE Point end() const { return c[0] + (c[1] + (c[2] + c[3])); }
  SIM_INLINE Point rate_at_start() const {
    const Doubles zero{};
    return c[1] + zero * (number(2) * c[2] + zero * c[3]);
  }
  SIM_INLINE Point rate_at_end() const { return c[1] + (number(2) * c[2] + number(3) * c[3]); }
  SIM_INLINE Doubles length() const {
    return norm(c[1]) + number(2) * norm(c[2]) + number(3) * norm(c[3]);
  }
  // From the start on, where m.
  SIM_INLINE void kick(Mask m, const Point& change) {
    c[0] = choose(m, c[0] - Doubles{} * change, c[0]);
    c[1] = choose(m, c[1] + change, c[1]);
    moved = choose(m, moved + change, moved);
    kicked = choose(m, kicked + change, kicked);
  }
  SIM_INLINE void press(Mask m, const Point& acceleration) {
    const Point half = number(0.5) * acceleration;
    c[2] = choose(m, c[2] + half, c[2]);
    moved = choose(m, moved + half, moved);
    kicked = choose(m, kicked + half, kicked);
  }
  SIM_INLINE void shift(Mask m, const Point& by) {
    c[0] = choose(m, c[0] + by, c[0]);
    moved = choose(m, moved + by, moved);
  }
};

SIM_INLINE Ways ways_of(const LyingStep& step, int i) {
  const Doubles h = number(step.h);
  const Point x0 = load(step.q0, i), x1 = load(step.q, i), r0 = h * load(step.v0, i), none{};
  if (!step.whole) return {{x0, r0, x1 - x0 - r0, none}, none, none};
  const Point r1 = h * load(step.v, i), d = x1 - x0;
  return {{x0, r0, number(3) * d - number(2) * r0 - r1, r0 + r1 - number(2) * d}, none, none};
}

// As Contacts::hold() of one surface: the velocities of the lanes m; those that come to no end are
// taken out of m.
template <PlainSurface::Form kForm>
SIM_INLINE Point held(const Surface<kForm>& surface, double friction, const Point& x, Point v,
                      Mask& m, Doubles& lost, Doubles& given) {
  const Doubles zero{}, mu = number(friction);
  const Seen seen = surface.touch(x);
  const Doubles carried = norm(surface.velocity);
  Mask inward = m & (seen.gap <= slack(x));
  for (int round = 0; round < kRounds; ++round) {
    const Point relative = v - surface.velocity;
    const Doubles normal = dot(relative, seen.normal);
    inward &= normal < zero;
    if (!bits_of(inward)) return v;
    const Point across = normal * seen.normal, slip = relative - across;
    const Doubles speed = norm(slip), most = -normal * mu;
    Point next = v - (across + zero * slip);
    if (friction > 0) {
      const Mask sticks = (most > zero) & (speed <= most);
      next = v - (across + choose(most > zero, most / speed, zero) * slip);
      next = choose(sticks, surface.velocity, next);
    }
    const Point change = next - v;
    given = choose(inward, given + dot(change, surface.velocity), given);
    lost = choose(inward, lost + dot(change, surface.velocity - number(0.5) * (v + next)), lost);
    v = choose(inward, next, v);
    inward &= -normal > number(1e-15) * (speed + carried);
  }
  m &= ~inward;
  return v;
}

// As Hold: pressed on through the step.
template <PlainSurface::Form kForm>
struct Press {
  const LyingStep& step;
  const Surface<kForm>& before;
  const Surface<kForm>& after;
  Seen start;
  Seen end;  // where the way ends before
  Mask stuck = {};
  Point place = {};  // of what is stuck

  // Those of m; the ones that turn round within the step are taken out of `known`.
  SIM_INLINE void press(Mask m, Ways& way, Mask& known) {
    const Doubles zero{}, least = number(0.1);
    if (step.friction == 0) return along(m, start.normal, way);
    const Doubles mu = number(step.friction), h = number(step.h);
    const Point rate = way.rate_at_start(), surface = h * before.velocity;
    const auto tangential = [&](const Point& v) __attribute__((always_inline)) {
      return v - dot(v, start.normal) * start.normal;
    };
    const Point slip = tangential(rate - surface);
    const Point drive = tangential(way.rate_at_end() - rate - (h * after.velocity - surface));
    Doubles speed = norm(slip);
    speed = speed <= number(1e-14) * (norm(rate) + norm(surface)) ? zero : speed;
    const Doubles pressure =
        larger(zero, number(-2) * end.gap / larger(dot(start.normal, end.normal), least));
    const Mask moves = speed != zero;
    const Doubles along_slip = dot(drive, slip) / speed;
    const Mask slides = m & moves & (speed + (along_slip - mu * pressure) >= zero);
    if (bits_of(slides)) along(slides, start.normal - (mu / speed) * slip, way);

    const Mask stops = m & ~slides;
    if (!bits_of(stops)) return;
    const Doubles braking = mu * pressure;
    known &= ~(stops & ~(norm(drive) <= braking));
    const Doubles time = speed / (braking - along_slip);
    place = way_at_start(way);
    if (step.moves) place = place + (after.center - before.center);
    place = place + choose(moves, number(0.5) * time * slip, Point{});
    const Seen there = after.touch(place);
    const Point out = there.gap * there.normal;
    place = choose(size(there.gap) > slack(place), place - out, place);
    way.press(stops, number(2) * (place - way.end()));
    stuck = stops;
  }

 private:
  SIM_INLINE static Point way_at_start(const Ways& way) {
    const Doubles zero{};
    return way.c[0] + zero * (way.c[1] + zero * (way.c[2] + zero * way.c[3]));
  }
  SIM_INLINE void along(Mask m, const Point& direction, Ways& way) {
    constexpr int kIterations = 8;  // of Hold
    Seen now = end;
    for (int n = 0; n < kIterations; ++n) {
      const Doubles share = larger(dot(direction, now.normal), number(0.1));
      way.press(m, (number(-2) * now.gap / share) * direction);
      const Point there = way.end();
      now = after.touch(there);
      m &= ~(size(now.gap) <= number(0.1) * slack(there));
      if (!bits_of(m)) return;
    }
  }
};

// The lanes of `free` from particle i on.
template <PlainSurface::Form kForm>
SIM_INLINE void settle_lanes(const LyingStep& step, const Surface<kForm>& before,
                             const Surface<kForm>& after, int i, unsigned free, int lane,
                             Lying& lying) {
  const Doubles zero{}, h = number(step.h);
  Ways way = ways_of(step, i);
  const Point x0 = way.c[0], x1 = load(step.q, i);
  const Doubles near_start = slack(x0);
  Press<kForm> press{step, before, after, before.touch(x0), after.touch(way.end())};
  const Point surface = h * before.velocity, rate = way.rate_at_start();
  const Doubles clear = after.gap(x1), inward = dot(rate - surface, press.start.normal);
  Mask known = mask_of(free) & (press.start.gap <= near_start) & (press.start.gap >= -near_start) &
               (clear <= zero) & (press.end.gap < zero) &
               (inward <= number(-kAnInstant) * press.end.gap);
  const unsigned led_in = bits_of(known);
  if (led_in != free) {  // others may come near nothing
    const Mask far = clear > way.length() + number(step.reach);
    lying.known |= (free & ~led_in & bits_of(far)) << lane;
  }
  if (!led_in) return;

  // The blow, as bounce().
  Doubles given = zero, lost = zero;
  Point blow{};
  if (const Mask hits = known & (inward < zero); bits_of(hits)) {
    const Doubles push = number(-(1 + step.restitution)) * inward;
    blow = push * press.start.normal;
    if (step.friction > 0) {
      const Point slip = rate - surface - inward * press.start.normal;
      const Doubles speed = norm(slip), most = number(step.friction) * push;
      blow = blow - choose(speed <= most, slip, (most / speed) * slip);
    }
    way.kick(hits, blow);
    given = choose(hits, dot(blow, surface), zero);
    lost = choose(hits, dot(blow, surface - rate - number(0.5) * blow), zero);
    press.end = after.touch(way.end());
  }

  // What is inside at the end is pressed on, and pushed out of what rounding leaves.
  Mask pressed = known & (press.end.gap < zero);
  if (bits_of(pressed)) {
    const Point kicked = way.kicked, moved = way.moved, end_rate = way.rate_at_end();
    const Point free_change = end_rate - way.rate_at_start();
    press.press(pressed, way, known);
    const Point kick = way.kicked - kicked;
    const Doubles gain =
        dot(kick, end_rate + number(0.5) * kick) - dot(free_change, way.moved - moved);
    given = choose(pressed, given + dot(kick, surface), given);
    lost = choose(pressed, lost + (dot(kick, surface) - gain), lost);
  }
  Mask inside = known;
  for (int round = 0; round <= kRounds; ++round) {
    const Seen seen = after.touch(choose(press.stuck, press.place, way.end()));
    inside &= seen.gap < zero;
    if (!bits_of(inside)) break;
    const Point out = -seen.gap * seen.normal;
    way.shift(inside, out);
    press.place = choose(inside, press.place + out, press.place);
    pressed |= inside;
  }
  known &= ~inside;
  if (step.room < HUGE_VAL) {  // a way that changes more may meet another surface
    const Point rest = way.moved - blow;
    const Doubles most = number(0.25 * step.room * step.room);
    known &= (dot(blow, blow) < most) & (dot(rest, rest) < most);
  }

  const Point place = choose(press.stuck, press.place, x1 + way.moved);
  const Point by = {way.kicked.x / h, way.kicked.y / h, way.kicked.z / h};
  Point velocity = load(step.v, i) + by;
  Doubles lost_held = zero, given_held = zero;
  if (step.whole) {
    Mask holds = known & pressed;
    const Mask asked = holds;
    velocity = held(after, step.friction, place, velocity, holds, lost_held, given_held);
    known &= ~(asked & ~holds);
  }
  keep_as(step.q, i, known, place);
  keep_as(step.v, i, known, velocity);
  store(lying.lost + lane, lost);
  store(lying.given + lane, given);
  store(lying.lost_held + lane, lost_held);
  store(lying.given_held + lane, given_held);
  const unsigned done = bits_of(known);
  lying.known |= done << lane;
  lying.met |= done << lane;
  lying.pressed |= (done & bits_of(pressed)) << lane;
}

template <PlainSurface::Form kForm>
void settle_all(const LyingStep& step, int begin, int end, Lying* lying) {
  const Surface<kForm> before(step.before), after(step.after);
  for (int i = begin; i < end; i += kLying, ++lying) {
    unsigned bits = step.free[i >> 3];
    if (end - i < kLying) bits &= (1u << (end - i)) - 1;
    lying->known = 0xff & ~bits;
    lying->met = lying->pressed = 0;
    for (int lane = 0; lane < kLying; lane += kDoubles)
      if (const unsigned free = bits >> lane & ((1u << kDoubles) - 1))
        settle_lanes(step, before, after, i + lane, free, lane, *lying);
  }
}

void settle_lying(const LyingStep& step, int begin, int end, Lying* lying) {
  if (step.after.form == PlainSurface::Form::kPlane)
    settle_all<PlainSurface::Form::kPlane>(step, begin, end, lying);
  else
    settle_all<PlainSurface::Form::kSphere>(step, begin, end, lying);
}

// v := held, and what follows from it.
template <PlainSurface::Form kForm>
bool hold_all(const LyingKick& kick, int begin, unsigned bits, Lying& lying) {
  const Surface<kForm> surface(kick.surface);
  Point velocity[kLying / kDoubles];
  Mask lanes[kLying / kDoubles];
  for (int n = 0; n < kLying / kDoubles; ++n) {
    const int i = begin + n * kDoubles;
    Doubles lost{}, given{};
    lanes[n] = mask_of(bits >> n * kDoubles);
    Mask done = lanes[n];
    velocity[n] = held(surface, kick.friction, load(kick.q, i), load(kick.v, i), done, lost, given);
    if (bits_of(lanes[n] & ~done)) return false;
    store(lying.lost_held + n * kDoubles, lost);
    store(lying.given_held + n * kDoubles, given);
  }
  for (int n = 0; n < kLying / kDoubles; ++n) {
    const int i = begin + n * kDoubles;
    keep_as(kick.v, i, lanes[n], velocity[n]);
    if (!kick.a[0]) continue;
    const Doubles keep_v = kick.next.keeps ? load(kick.next.keeps + i) : number(kick.next.keep);
    const Doubles gain = kick.next.keeps ? load(kick.next.gains + i) : number(kick.next.gain);
    const Point a = load(kick.a, i), kept = keep_v * velocity[n];
    const Point next = {fma(gain, a.x, kept.x), fma(gain, a.y, kept.y), fma(gain, a.z, kept.z)};
    keep_as(kick.v_after, i, lanes[n], next);
    if (!kick.q_next[0]) continue;
    const Doubles drift = number(kick.drift);
    const Point q = load(kick.q, i);
    keep_as(kick.q_next, i, lanes[n],
            {fma(drift, next.x, q.x), fma(drift, next.y, q.y), fma(drift, next.z, q.z)});
  }
  return true;
}

bool hold_lying(const LyingKick& kick, int i, unsigned bits, Lying& lying) {
  return kick.surface.form == PlainSurface::Form::kPlane
             ? hold_all<PlainSurface::Form::kPlane>(kick, i, bits, lying)
             : hold_all<PlainSurface::Form::kSphere>(kick, i, bits, lying);
}

constexpr LyingKernels kKernels{settle_lying, hold_lying};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

LyingKernels lying_kernels() { return SIM_CHOOSE(kKernels); }

}  // namespace sim
#endif
